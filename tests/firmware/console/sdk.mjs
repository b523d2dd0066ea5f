// Improv's own client sets a robot's network: node sdk.mjs <its serial.js> <port>
import { pathToFileURL } from "node:url";

import { openPort } from "./web_serial.mjs";

const [client, path] = process.argv.slice(2);
const { ImprovSerial } = await import(pathToFileURL(client));
const quiet = { log() {}, debug() {}, error(...words) { said.push(words.join(" ")); } };
const said = [], states = [];

const improv = new ImprovSerial(openPort(path), quiet);
improv.addEventListener("state-changed", (event) => states.push(event.detail));
const info = await improv.initialize(20000);
const ready = improv.state;
const networks = await improv.scan();
const refused = await improv.provision("lab-net", "wrong horse").catch(String);
const error = improv.error;
await improv.provision("lab-net", "correct horse");
const provisioned = improv.state;
await improv.requestCurrentState();
const name = await improv.setDeviceName("woodbot-3");
const bad = await improv.setDeviceName("wood bot").catch(String);
const unknown = await improv.requestNetworkState().catch(String);
await improv.close();
const all = JSON.stringify({
  info, ready, networks, refused, error, provisioned, states, name, bad, unknown,
  url: improv.nextUrl ?? null, said,
});
// The client leaves a timer behind, which node would wait for.
process.stdout.write(all, () => process.exit());

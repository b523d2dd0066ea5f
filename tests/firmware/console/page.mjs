// The page's own program, without its page: node page.mjs <index.html> <port>
import fs from "node:fs";

import { openPort } from "./web_serial.mjs";

const [page, path] = process.argv.slice(2);
const program = fs.readFileSync(page, "utf8").match(
  /<script id="program">([^]*?)<\/script>/)[1];
const { Robot } = new Function(`${program}; return { Robot };`)();

const robot = new Robot(openPort(path)), told = [];
await robot.find();
const info = await robot.info();
const networks = await robot.scan();
const tell = (text) => told.push(text);
const wishes = { name: "woodbot-7", fabric: "", router: "tcp/192.168.1.20:7447",
                 ssid: "lab-net", password: "wrong horse" };
const refused = await robot.provision(wishes, tell).catch((error) => error.message);
await robot.provision({ ...wishes, password: "correct horse" }, tell);
const enterprise = { ssid: "eduroam", user: "anna@example.org", password: "anna's own" };
await robot.provision(enterprise, tell);
const bad = await robot.provision({ name: "-" }, tell).catch((error) => error.message);
const broken = await robot.ask("set name a\nreset").catch((error) => error.message);
const status = await robot.ask("status");
const sensors = await robot.ask("test sensors");
await robot.close();
console.log(JSON.stringify({
  info, networks, refused, told, bad, broken, status, sensors,
}));

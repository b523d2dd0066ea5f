"""The verbs and the nouns of the command line, and what other tools call them."""

#: verb -> its effect; each is a module here with `EXAMPLES`, `add(parser)` and
#: `run(args)`. A beginner's come first.
VERBS = {
    "demo": "run one Woodbot three ways, and compare",
    "new": "write a short file to begin with, which runs at once",
    "run": "run an experiment from a file",
    "check": "check an experiment, or a robot",
    "show": "show robots, drivers, inputs, processes, outputs",
    "plot": "draw a run that is over",
    "compare": "compare the robots of a run that is over",
    "rerun": "do a recorded run again, and compare it to the bit",
    "list": "list the agents on the fabric",
    "get": "read values by their key",
    "watch": "follow values as they change",
    "dashboard": "show the fabric on a page in the browser",
    "put": "command a robot",
    "drive": "drive robots by the keys of this terminal",
    "why": "find out why something does not work",
    "stop": "stop every robot, until released",
}

#: subject -> verbs of it that are needed less often, with their effects
MORE = {
    "agents": {"call": "call a method of an agent"},
    "experiments": {"sweep": "run one many times, into one table"},
    "recordings": {
        "info": "show what is in the recording of a run",
        "export": "write a recording as CSV or Parquet files",
        "replay": "play a recording on a fabric",
        "animate": "make a film of a run that is over",
        "identify": "find a robot's parameters from how it drove",
        "repair": "give a recording its end after a power cut",
    },
    "cameras": {
        "markers": "make a page of markers to print",
        "lens": "find a camera's lens from pictures of a chessboard",
    },
    "rems": {
        "explain": "explain the code at the end of an error, such as R0104",
        "docs": "open the pages",
        "completion": "let Tab complete commands",
    },
}
#: verb of MORE -> its effect; modules as those of VERBS
RARE = {verb: doc for verbs in MORE.values() for verb, doc in verbs.items()}

#: noun -> its verbs with their effects; each is a module in the package of the noun
NOUNS = {
    "agent": {
        "start": "start agents on an open fabric",
        "bring": "bring agents to a run on another machine",
    },
    "clock": {
        "pause": "stop time",
        "step": "make some ticks, then pause",
        "resume": "let time go on",
        "pace": "set how fast time goes",
        "end": "end the run as if its duration were over",
    },
    "router": {
        "use": "use the router of a class from now on",
        "forget": "forget the router of the class",
        "status": "show the router that is used, and test the way to it",
        "serve": "be an open fabric, for a class: a router and a clock",
    },
    "board": {
        "ports": "list serial ports, and what answers there",
        "flash": "write a ready image to a robot's board",
        "provision": "give a robot its name, its Wi-Fi and its router",
        "bridge": "connect a robot without Wi-Fi, over its USB cable",
        "calibrate": "measure a Woodbot's servos, and store it in the robot",
        "generate": "write a definition for a robot's firmware, as C",
        "emulate": "run robots without hardware: Woodbots, or a device",
    },
}

#: every command, as people type it, with its effect
COMMANDS = {
    **VERBS,
    **RARE,
    **{
        f"{noun} {verb}": doc
        for noun, verbs in NOUNS.items()
        for verb, doc in verbs.items()
    },
}

#: commands that take a script, whose own arguments follow `--`
OF_SCRIPTS = ("run", "check", "agent start")

#: commands for a fabric that may be on another machine; that of `run` may not
AWAY = {
    *("list", "get", "watch", "dashboard", "put", "drive", "call", "why", "stop"),
    "router serve",
    *("agent start", "agent bring", "board emulate", "board calibrate"),
    *(f"clock {verb}" for verb in NOUNS["clock"]),
}

#: verb of other tools, such as ROS 2 -> what does it here
OTHERS = {
    "bag": "info runs/lab",
    "echo": "watch 'robot/*/state'",
    "launch": "run lab.toml",
    "node": "list",
    "param": "show woodbot",
    "service": "call robot/sim reset",
    "set": "put robot/sim/command wheel/left=3",
    "topic": "list",
}

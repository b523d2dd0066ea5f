"""Names of environments for `gymnasium.make`, such as rems_net.gym:rems_net/Lab-v0."""

from rems_net.gym.library import register, registry

#: name -> the function that makes it
NAMES = {
    "rems_net/Lab-v0": "rems_net.gym.making:make",
    "rems_net/Woodbot-v0": "rems_net.gym.making:woodbot",
}

for name, function in NAMES.items():
    if name not in registry:
        register(name, entry_point=function)

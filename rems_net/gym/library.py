"""Library: the part of gymnasium that environments need; imported here alone.

It gets our names for `gymnasium.make`, such as rems_net.gym:rems_net/Lab-v0.
"""

from rems_net.libraries import needed

with needed("gymnasium", "gym"):
    from gymnasium import Env as Env, register
    from gymnasium.envs.registration import registry
    from gymnasium.spaces import (
        Box as Box,
        Dict as Dict,
        Discrete as Discrete,
        Space as Space,
    )
    from gymnasium.vector import AutoresetMode as AutoresetMode, VectorEnv as VectorEnv
    from gymnasium.vector.utils import batch_space as batch_space

#: name -> the function that makes it
NAMES = {
    "rems_net/Lab-v0": "rems_net.gym.making:make",
    "rems_net/Woodbot-v0": "rems_net.gym.making:woodbot",
}

for name, function in NAMES.items():
    if name not in registry:
        register(name, entry_point=function)

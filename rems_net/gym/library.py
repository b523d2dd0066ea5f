"""Library: the names of gymnasium that environments need; imported here alone."""

from rems_net.libraries import needed

with needed("gymnasium", "gym"):
    from gymnasium import Env as Env
    from gymnasium import register as register
    from gymnasium.envs.registration import registry as registry
    from gymnasium.spaces import Box as Box
    from gymnasium.spaces import Dict as Dict
    from gymnasium.spaces import Discrete as Discrete
    from gymnasium.spaces import Space as Space
    from gymnasium.vector import AutoresetMode as AutoresetMode
    from gymnasium.vector import VectorEnv as VectorEnv
    from gymnasium.vector.utils import batch_space as batch_space

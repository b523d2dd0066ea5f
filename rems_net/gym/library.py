"""Library: the names of gymnasium that environments need; imported here alone."""

from rems_net.libraries import needed

with needed("gymnasium", "gym"):
    from gymnasium import Env as Env, register as register
    from gymnasium.envs.registration import registry as registry
    from gymnasium.spaces import (
        Box as Box,
        Dict as Dict,
        Discrete as Discrete,
        Space as Space,
    )
    from gymnasium.vector import AutoresetMode as AutoresetMode, VectorEnv as VectorEnv
    from gymnasium.vector.utils import batch_space as batch_space

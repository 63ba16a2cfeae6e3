"""The tiny networks of `tests.recorded.tiny` as modules."""

from motionloom_train.modules import fill
from motionloom_train.nets.prior import NetConfig, PriorNet
from tests.recorded import tiny


def tiny_net(config: NetConfig = tiny.MODULATED, seed: int = 0) -> PriorNet:
    """A prior's network whose every weight matters; of any sizes."""
    net = PriorNet(config)
    fill(net, tiny.weights(config, seed), "a tiny network")
    return net.eval().requires_grad_(False)

from tests.build.targets import device

__all__ = ["device"]

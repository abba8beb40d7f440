"""The stub's clients as those of `pybullet_utils`."""

from pybullet import Client as BulletClient

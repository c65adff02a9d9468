"""What can go wrong, in the words of the command: what was found, and what to do."""


class BonepdError(Exception):
    """All errors of this package."""


class SettingError(BonepdError, ValueError):
    """A setting that cannot be used, or does not fit the scan."""


class SpecimenError(BonepdError, ValueError):
    """A scan for which the request makes no sense."""


class FileError(BonepdError, OSError):
    """A file or folder that cannot be read, understood or written."""


class BonepdWarning(UserWarning):
    """What changes how a result is read: the lines that the command begins with ``warning:``."""

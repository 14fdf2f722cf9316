# SPDX-License-Identifier: GPL-3.0-or-later
"""What the module raises."""


class InputError(ValueError):
    """Bad input: names the keyword, array or file, its value and the rule that it broke."""


class RunError(RuntimeError):
    """Something outside of the program failed while it ran: a full disk, a lost file."""


# FileNotFoundError comes first since its instances need its __new__().
class MissingFileError(FileNotFoundError, InputError):
    """A file or folder that is to be read does not exist; an InputError, too."""

    def __str__(self):
        return self.strerror if isinstance(self.strerror, str) else super().__str__()

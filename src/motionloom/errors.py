"""The one exception a user is meant to see."""


class MotionloomError(ValueError):
    """A mistake in what came from outside: a file, a prompt, an option.

    The message is one sentence (what was wrong, what was there, what to do); the command line prints it
    to stderr and exits with 2. Programming errors stay ordinary exceptions.
    """

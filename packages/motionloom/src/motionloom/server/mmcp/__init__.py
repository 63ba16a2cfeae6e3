"""MMCP, the protocol that animation programs speak to motion models: `docs/mmcp.md`. Needs the extra ``mmcp``.

The SDK (`motionmcp`) checks requests and writes answers; here a request becomes a motion of the library.
"""

"""Read this first: a weight file, a sentence, a motion, without anything else of the house.

Arrays and `Motion` go in, arrays and `Motion` come out; NumPy and ONNX Runtime are all it needs.

    motion.py skeleton.py rotations.py ground.py    a person as numbers
    diffusion/    schedule, solvers, the loop, two kinds of edits (Ho et al. 2020; Song et al. 2021)
    features/     263 numbers a frame, and back (Guo et al. 2022)
    models/       a weight file becomes a denoiser
    methods/      one section of the papers a file
    body/         places to rotations, feet that stand
    files/        files that appear whole; .bvh and .npz out
"""

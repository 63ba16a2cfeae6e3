"""One section of the papers a file: how motion is sampled from a prior.

text          Tevet et al. 2023, *Human Motion Diffusion Model*: text to motion, classifier-free guidance
edit          the same, section 3 "Editing": in-betweening, parts of the body
double_take   Shafir et al. 2024, *Human Motion Diffusion as a Generative Prior*, section 4.1: long motion
com_mdm       the same, section 4.2: two people through a communication block
control       the same, section 4.3: fine-tuned control, algorithms 1 and 2
blending      the same, section 4.3: DiffusionBlending
humanmac      Chen et al. 2023, *HumanMAC*: prediction, switch and part control in the frequencies of a window
"""

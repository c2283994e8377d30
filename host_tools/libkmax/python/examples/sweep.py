"""How much does a wall oscillate, by its stiffness? On the simulated device, several walls at once."""

from concurrent.futures import ThreadPoolExecutor

import kmax

stiffnesses = [500, 1000, 2000, 4000]  # N/m


def touch(stiffness):
    return kmax.run_scene("touch", {"wall.stiffness": stiffness})


with ThreadPoolExecutor() as pool:  # a scene does not hold the interpreter's lock
    scenes = list(pool.map(touch, stiffnesses))
for stiffness, scene in zip(stiffnesses, scenes):
    print(f"{stiffness:5} N/m: {scene.contact}, {scene.peak_to_peak * 1e3:.3f} mm peak to peak")

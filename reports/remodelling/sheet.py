"""Maps of several runs side by side, as the program drew them (PyPI: pillow).

    python3 reports/remodelling/sheet.py PICTURE.png MAP.png MAP.png ...
"""

import sys

from PIL import Image

target, *names = sys.argv[1:]
maps = [Image.open(name).convert("RGB") for name in names]
sheet = Image.new("RGB", (sum(m.width for m in maps), max(m.height for m in maps)), "white")
left = 0
for m in maps:
    sheet.paste(m, (left, 0))
    left += m.width
sheet.quantize(96, Image.Quantize.FASTOCTREE).save(target, optimize=True)

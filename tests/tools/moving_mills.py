"""Small mills of bodies and motions: a jar that turns on a turning disk, and a tank whose pins stir."""

CHARGE = """\
[balls]
count = {count}
diameter = 5 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
friction = 0.3
[output]
frames = 2 ms
"""
JAR_ON_A_DISK = """\
[motion.sun]
kind = turn
speed = 600 rpm
[motion.jar]
kind = turn
on = sun
centre = 60 0 0 mm
speed = -1200 rpm
[body.jar]
shape = cylinder
side = inside
motion = jar
centre = 60 0 0 mm
radius = 20 mm
length = 30 mm
"""
PLANETARY = "[run]\ntime = 900 ms\nsample_from = 400 ms\n" + JAR_ON_A_DISK + CHARGE.format(count=12)
ATTRITOR = """\
[run]
time = 250 ms
sample_from = 50 ms
[body.tank]
shape = cylinder
side = inside
radius = 30 mm
length = 60 mm
[motion.stirrer]
kind = turn
speed = 1200 rpm
[body.pin]
shape = cylinder
motion = stirrer
axis = 1 0 0
radius = 3 mm
length = 44 mm
centre = 0 0 -15 mm
copies = 3
turn_by = 60 deg
shift_by = 0 0 15 mm
""" + CHARGE.format(count=80)

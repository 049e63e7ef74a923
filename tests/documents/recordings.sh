# What the reader of tools/README.md brings: recordings of a RAVEN (the digital twin), the authors' table and the
# encoders' truth of one of them, a model of Keras, and another robot (a pendulum with dry friction) with its model.
export PATH="$PWD/build/release/tools:$PWD/build/release/quadrature_reader:$PATH"
plant=tools/plants/raven2.toml
for seed in 1 2 3 4; do
  ravencal trajectory sinusoid --duration-s 20 --seed $seed --out $seed.csv
  edges=$([ $seed != 2 ] || echo --edges edges.db)
  homing=$([ $seed = 4 ] && echo 4 || echo 1)  # run4 tests, in a session of its own
  ravencal simulate --plant $plant --trajectory $seed.csv --seed $seed --homing-seed $homing $edges --out run$seed.db
done
ravencal-encoders --config quadrature_reader/encoders.toml --replay edges.db --home --out truth.db
ravencal merge run2.db truth.db --out merged.db
ravencal export merged.db --to-s 19.9 --profile raven2 --out authors.csv
rm [1-4].csv run2.db edges.db merged.db
cp tests/golden/models/keras2_dense.h5 model.h5
cp tests/golden/models/scaling.json .
cat >robot.xml <<'END'
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="arm">
      <joint name="elbow" axis="0 -1 0" armature="0.01" limited="true" range="-1.5 1.5"/>
      <inertial pos="0 0 -0.2" mass="1" diaginertia="0.001 0.001 0.001"/>
    </body>
  </worldbody>
  <actuator><motor name="elbow motor" joint="elbow"/></actuator>
</mujoco>
END
/usr/bin/python3 - >other.csv <<'END'
from math import copysign, pi, sin
position, velocity, substeps = 0.0, 0.0, 20
print("t_s,elbow_pos_rad,elbow_vel_rad_s,elbow_tau_Nm")
for row in range(6000):
    t = row / 200
    torque = 1.5 * sin(2 * pi * 0.4 * t) + 0.8 * sin(2 * pi * 0.9 * t)
    print(f"{t:.3f},{position:.6f},{velocity:.6f},{torque:.6f}")
    for _ in range(substeps):
        drive = torque - 9.81 * 0.2 * sin(position)
        friction = copysign(min(0.2, abs(drive)), velocity or drive)
        velocity += (drive - friction) / 0.051 / 200 / substeps
        position += velocity / 200 / substeps
END

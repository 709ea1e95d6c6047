#!/usr/bin/env bash
# The paper on the 3PRR machine from files: a circle of the platform, virtual logs of the machine, identification with friction that follows the load of the
# guideway and with friction that does not, both judged on the circle, export. Writes to prr3-run beside examples/.
#
#   examples/prr3/run.sh [DYNID]
set -euo pipefail
cd "$(dirname "$0")/../.."
dynid=${1:-dynid}
here=examples/prr3
out=prr3-run

"$dynid" design $here/design.toml
"$dynid" motion $here/circle.toml --out $out/circle
"$dynid" simulate $here/robot.toml --config $here/simulate.toml --follow $out/design/trajectory.json --out $out/train.csv --truth $out/truth.json --force
"$dynid" simulate $here/robot.toml --config $here/simulate.toml --seed 4 --follow $out/circle/trajectory.csv --out $out/circle.csv --clean $out/circle-true.csv --force
"$dynid" check $out/train.csv --robot $here/robot.toml
"$dynid" identify $here/identify.toml
# Friction that no load changes does not explain this motion: the verdict fails, as it should.
"$dynid" identify $here/constant.toml || test $? -eq 1
for model in varying constant; do
    echo "friction: $model"
    "$dynid" validate $out/$model/estimate.json --log $out/circle.csv
    "$dynid" predict $out/$model/estimate.json --states $out/circle-true.csv --out $out/$model/circle.csv
done
"$dynid" export $out/varying/estimate.json --model $out/prr3.json --allow-unphysical --force

#!/usr/bin/env bash
# The paper on the X-Y pointing mechanism from files: excitation, virtual logs of the machine and of probes at its journals, pre-flight, identification
# with the bee colony of the paper beside it, once more with weighed links and with ideal joints, validation on another motion, the clearances
# themselves, export. Writes to xy-run beside examples/.
#
#   examples/xy-pointing/run.sh [DYNID]
set -euo pipefail
cd "$(dirname "$0")/../.."
dynid=${1:-dynid}
here=examples/xy-pointing
out=xy-run

"$dynid" design $here/design.toml
"$dynid" simulate $here/robot.toml --config $here/simulate.toml --follow $out/design/trajectory.json --out $out/train.csv --truth $out/truth.json --force
"$dynid" simulate $here/robot.toml --config $here/simulate.toml --seed 2 --duration 16 --out $out/valid.csv --force
"$dynid" check $out/train.csv --robot $here/robot.toml
for model in identify weighed ideal; do
    "$dynid" identify $here/$model.toml
    "$dynid" validate $out/$model/estimate.json --log $out/valid.csv --json > $out/$model.json
done
"$dynid" clearance $here/robot.toml $out/identify/estimate.json --log $out/valid.csv
"$dynid" export $out/identify/estimate.json --mjcf $out/pointing.xml --model $out/pointing.json --force

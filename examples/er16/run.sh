#!/usr/bin/env bash
# The paper on the ER-16 from files: excitation, virtual logs of the machine, pre-flight, identification with the searches of the paper beside it,
# validation on another motion, export. Writes to er16-run beside examples/.
#
#   examples/er16/run.sh [DYNID]
set -euo pipefail
cd "$(dirname "$0")/../.."
dynid=${1:-dynid}
here=examples/er16
out=er16-run

"$dynid" design $here/design.toml
"$dynid" simulate robots/er16.toml --config $here/simulate.toml --follow $out/design/trajectory.json --out $out/train.csv --truth $out/truth.json --force
"$dynid" simulate robots/er16.toml --config $here/simulate.toml --seed 2 --duration 20 --out $out/valid.csv --force
"$dynid" check $out/train.csv --robot $here/robot.toml
"$dynid" identify $here/identify.toml
"$dynid" validate $out/result/estimate.json --log $out/valid.csv
"$dynid" export $out/result/estimate.json --mjcf $out/er16.xml --model $out/er16.json --force

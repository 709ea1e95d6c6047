#!/usr/bin/env bash
# The two-step method on the Indy7 from files: sweeps at three temperatures, friction laws with thermal lines, identification beside them from a cold
# log, judged on a hot one; and one step, which knows no temperature. Writes to two-step-run beside examples/.
#
#   examples/indy7/two-step/run.sh [DYNID]
set -euo pipefail
cd "$(dirname "$0")/../../.."
dynid=${1:-dynid}
here=examples/indy7/two-step
out=two-step-run

"$dynid" motion $here/sweeps.toml
for t in 20 30 42; do
    "$dynid" simulate $here/machine.toml --config $here/at-$t.toml --seed $t --follow $out/sweeps/trajectory.csv --out $out/sweeps-$t.csv --truth $out/truth.json --force
done
"$dynid" friction $here/friction.toml
"$dynid" simulate $here/machine.toml --config $here/at-20.toml --seed 1 --duration 60 --out $out/cold.csv --force
"$dynid" simulate $here/machine.toml --config $here/at-42.toml --seed 2 --duration 30 --out $out/hot.csv --force
"$dynid" identify $here/identify.toml
"$dynid" identify $here/one-step.toml
for model in two-step one-step; do
    echo "on the hot log: $model"
    "$dynid" validate $out/$model/estimate.json --log $out/hot.csv
done

#!/usr/bin/env bash
# The flexible joint from files: virtual logs, identification of stiffness and friction, validation, and on line the change of a worn joint, named.
# Writes to hit-run beside examples/.
#
#   examples/hit-joint/run.sh [DYNID]
set -euo pipefail
cd "$(dirname "$0")/../.."
dynid=${1:-dynid}
here=examples/hit-joint
out=hit-run

mkdir -p $out
"$dynid" simulate robots/hit-joint.toml --duration 60 --seed 1 --out $out/new.csv --truth $out/truth.json --force
"$dynid" simulate robots/hit-joint.toml --duration 30 --seed 2 --out $out/other.csv --force
"$dynid" simulate robots/hit-joint.toml --config $here/worn.toml --out $out/worn.csv --force
"$dynid" identify $here/identify.toml
"$dynid" validate $out/result/estimate.json --log $out/other.csv
# Exit code 1: something changed.
"$dynid" online $here/online.toml > $out/events.jsonl || [ $? -eq 1 ]
grep '"event":"change"' $out/events.jsonl

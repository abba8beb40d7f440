#!/usr/bin/env bash
# Measures the library's scenes on this machine and writes docs/report: index.html, report.json, report.csv,
# prices.md, and docs/figures/report_*.png. Takes some minutes; leave the machine alone meanwhile.
set -euo pipefail
cd "$(dirname "$0")/../.."
source .ci/dependencies.sh

scenes="bouncing_ball newtons_cradle billiard_break marbles_in_a_box dropped_wrench marble_rolls_on_wood jello_and_marbles"

carom_require $carom_build_packages $carom_bench_packages $carom_page_packages $carom_figure_packages
carom_build release
build/release/carom report $(printf 'scenes/library/%s.json ' $scenes) --runs 3 -o docs/report
python3 docs/report/prices.py docs/report/report.json >docs/report/prices.md
python3 tests/report_page/page_test.py --page docs/report/index.html
/usr/bin/python3 tests/bench/plot_report.py docs/report/report.json docs/figures

#!/usr/bin/env bash
# Draws all pictures of the docs, and makes the sounds of docs/sounds:
#
#     docs/figures/make.sh [CAROM TEMPLATE]
#
# with a command and a page's template that are there (docs/view.md; one without the engine will do, as stills make no sound), or
# else with those that it builds first. What was measured is read from docs/figures/data, tests/bench/baseline.json and
# docs/report/report.json; each plot_*.py says how that is made.
# docs/figures/gallery.png is a picture of the page of all scenes by hand.
set -euo pipefail
cd "$(dirname "$0")/../.."
source .ci/dependencies.sh
[ $# -eq 0 ] || [ $# -eq 2 ] || { sed -n '2,4s/^# \{0,1\}//p' "$0" >&2; exit 2; }

carom_require $carom_page_packages $carom_figure_packages
if [ $# -eq 0 ]; then
  carom_require $carom_build_packages $carom_web_packages
  carom_build release carom
  carom_build web
fi
carom=${1:-build/release/carom} template=${2:-build/web/web/carom_view.html}

# Debian's Python, which has Debian's packages.
python=/usr/bin/python3
$python tests/bench/plot_scenes.py "$carom" docs/figures --sounds docs/sounds --template "$template"
$python tests/bench/plot_worlds.py tests/bench/baseline.json docs/figures/worlds.png
$python tests/bench/plot_jello.py docs/figures/data/jello_accuracy.txt docs/figures
$python tests/bench/plot_modal_accuracy.py docs/figures/data/modal_accuracy.csv docs/figures/modal_accuracy.png
$python tests/bench/plot_acceleration_noise_error.py docs/figures/data/acceleration_noise_error.csv docs/figures/acceleration_noise_error.png
$python tests/bench/plot_report.py docs/report/report.json docs/figures

#pragma once

#include "audio/run/playable_run.h"

namespace carom::lab {

/// Returns a run as a page keeps it: numbers of lasting contacts, of poses and of models have as
/// many digits as the sound asks for, and what no sound asks for repeats what stood before, so that
/// steps of contacts do not make most of a page. What slides or rolls sounds as loud as before but
/// has not its samples (docs/view.md). [any thread]
audio::PlayableRun pageSound(audio::PlayableRun run);

}  // namespace carom::lab

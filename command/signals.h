#pragma once

namespace carom::command {

/// Has the program end cleanly on SIGINT, SIGTERM and SIGHUP, unless they are ignored: partial
/// files are removed, files that had their names before stay, and the program ends by the signal
/// (130, 143 and 129 in a shell). A file that would exceed the limit of sizes is an error like a
/// full disk. To be called first, before there is another thread. Does nothing where the system has
/// no such signals.
void endCleanlyOnSignals();

/// The same without a word, for a process that another has begun, and that was a copy of it.
void endSilentlyOnSignals();

/// Hands those signals on to a process that this one waits for, from now on, instead of ending by
/// them; 0: ends by them again.
void handSignalsTo(int process);

/// Gives the process back the signals with which it was started, for a program that it is about to
/// become. [in the child of a fork]
void restoreSignals();

}  // namespace carom::command

#pragma once

namespace carom::command {

/// Opens the null device where standard input, output or error is closed, as the next file would
/// get its number, and what is written there. Writing to such an output fails, as to a closed one;
/// messages are lost. To be called before any file is opened. Does nothing where the system has no
/// such numbers.
void keepStandardStreams();

/// Has the program end cleanly on SIGINT, SIGTERM, SIGHUP, SIGQUIT and SIGXCPU, unless they are
/// ignored: partial files are removed, files that had their names before stay, and the program ends
/// by the signal (130, 143 and 129 in a shell). A file that would exceed the limit of sizes is an
/// error like a full disk, and so is a pipe whose reader has gone. To be called first, before there
/// is another thread. Does nothing where the system has no such signals.
void endCleanlyOnSignals();

/// Ends the program as a reader that has gone would: cleanly, by SIGPIPE.
void endAsWithoutReader();

/// The same as endCleanlyOnSignals without a word, for a process that another has begun, and that
/// was a copy of it.
void endSilentlyOnSignals();

/// Hands those signals on to a process that this one waits for, from now on, instead of ending by
/// them; 0: ends by them again.
void handSignalsTo(int process);

/// Gives the process back the signals with which it was started, for a program that it is about to
/// become. [in the child of a fork]
void restoreSignals();

}  // namespace carom::command

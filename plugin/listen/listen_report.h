#pragma once

#include <string>

namespace carom::listen {

/// Appends a line to the report of `carom listen`; where that cannot be, nothing happens: a program
/// that is listened to must not be disturbed. [any thread]
void addToReport(const std::string& line);

/// Appends a sentence that the user is to be told.
void tellUser(const std::string& sentence);

/// Makes the file of that name in the folder of `carom listen`, empty. False if it is there
/// already, or cannot be made. [any thread, any process]
bool claim(const std::string& name);

}  // namespace carom::listen

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lab/video/child_process.h"
#include <nlohmann/json.hpp>

#include "carom/audio/result.h"

namespace carom::lab {

/// Chromium without a window, with one page, driven through the pipe of its DevTools protocol:
/// messages in JSON, each with a NUL behind it, on its descriptors 3 and 4. It draws without
/// graphics hardware, so that pictures are the same on every machine, has no network, and writes
/// into its folder only. Errors are the second half of a sentence about the browser. [one thread]
class ChromiumPipe {
 public:
  /// Starts `program`, with its profile in `folder`. `prepare` is that of ProgramStart.
  static Result<ChromiumPipe> start(const std::filesystem::path& program,
                                    const std::filesystem::path& folder, void (*prepare)());
  ChromiumPipe(ChromiumPipe&&) = default;
  ChromiumPipe& operator=(ChromiumPipe&&) = default;
  ~ChromiumPipe();

  /// Opens a file as the page, dark or light, with a question mark and `query` behind its name.
  Status open(const std::filesystem::path& page, const std::string& query, bool isLight);

  /// Sends a script, and returns the number of its answer.
  Result<std::uint64_t> ask(const std::string& script);
  /// Waits for the value of a script, or of its promise. An error is also what the script throws.
  Result<nlohmann::json> answer(std::uint64_t number);
  /// Sends a script, and waits for its value.
  Result<nlohmann::json> run(const std::string& script);

 private:
  ChromiumPipe(Descriptor connection, ChildProcess process, std::filesystem::path messages)
      : connection_(std::move(connection)),
        process_(std::move(process)),
        messages_(std::move(messages)) {}

  Result<std::uint64_t> send(const std::string& method, nlohmann::json parameters);
  Result<nlohmann::json> receive(std::uint64_t number);
  Result<nlohmann::json> call(const std::string& method, nlohmann::json parameters);
  Result<nlohmann::json> nextMessage();
  Error ended() const;

  Descriptor connection_;
  ChildProcess process_;
  std::filesystem::path messages_;  // its stderr
  std::string session_;             // of the page; empty: none yet
  std::uint64_t number_ = 0;        // of the last message that was sent
  std::string rest_;                // received, behind the last whole message
};

}  // namespace carom::lab

#include "lab/video/chromium_pipe.h"

#include <cerrno>
#include <chrono>
#include <fstream>
#include <span>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace carom::lab {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int kPatience = 300'000;                       // ms for an answer, of a slow machine too
constexpr std::chrono::milliseconds kLeaves(5000);       // for an orderly end
constexpr std::size_t kPortion = std::size_t{1} << 18U;  // bytes that are received at a time
constexpr int kReads = 3;                                // descriptors of the browser
constexpr int kWrites = 4;

std::vector<std::string> launchWords(const fs::path& program, const fs::path& folder) {
  std::vector<std::string> words = {
      program.string(), "--headless=new", "--remote-debugging-pipe",
      "--user-data-dir=" + (folder / "profile").string(),
      // Pictures are the same with every graphics card and on every screen.
      "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
      "--force-color-profile=srgb", "--force-device-scale-factor=1", "--window-size=640,400",
      "--hide-scrollbars", "--mute-audio",
      // It talks to nobody and asks nothing.
      "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-quic", "--no-first-run",
      "--no-default-browser-check", "--disable-background-networking", "--disable-component-update",
      "--disable-sync", "--disable-extensions", "--disable-breakpad", "--disable-crash-reporter",
      "--disable-dev-shm-usage", "--password-store=basic"};
  // Chromium refuses its sandbox to root.
  if (geteuid() == 0) words.emplace_back("--no-sandbox");
  words.emplace_back("about:blank");
  return words;
}

/// Returns the last line of a text file that is not empty, without the place in the browser's
/// sources that it may begin with; at most 200 characters.
std::string lastLine(const fs::path& file) {
  std::ifstream stream(file);
  std::string last;
  for (std::string line; std::getline(stream, line);)
    if (!line.empty()) last = line;
  if (const auto place = last.find("] "); last.starts_with('[') && place != std::string::npos)
    last.erase(0, place + 2);
  return last.substr(0, 200);
}

/// Returns the address of a file, with all but the plainest characters escaped.
std::string addressOf(const fs::path& file) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/-_.~";
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string address = "file://";
  for (const char letter : fs::absolute(file).string()) {
    const auto byte = static_cast<unsigned char>(letter);
    if (kPlain.find(letter) != std::string_view::npos)
      address += letter;
    else
      address += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
  }
  return address;
}

}  // namespace

Result<ChromiumPipe> ChromiumPipe::start(const fs::path& program, const fs::path& folder,
                                         void (*prepare)()) {
  auto [ours, theirs] = connectedPair();
  if (ours.number() < 0) return Error{"cannot be started: there are no descriptors left"};
  const fs::path messages = folder / "browser.txt";
  ChildProcess process({.words = launchWords(program, folder),
                        .channels = {{kReads, theirs.number()}, {kWrites, theirs.number()}},
                        .messages = messages,
                        .home = folder,
                        .prepare = prepare});
  if (!process.runs()) return Error{"cannot be started"};
  theirs.close();
  ChromiumPipe browser(std::move(ours), std::move(process), messages);
  const Result<json> target = browser.call("Target.createTarget", {{"url", "about:blank"}});
  if (!target) return target.error();
  const Result<json> attached =
      browser.call("Target.attachToTarget",
                   {{"targetId", target->value("targetId", std::string())}, {"flatten", true}});
  if (!attached) return attached.error();
  browser.session_ = attached->value("sessionId", std::string());
  return browser;
}

ChromiumPipe::~ChromiumPipe() {
  if (!process_.runs()) return;
  session_.clear();
  if (send("Browser.close", json::object())) process_.wait(kLeaves);
}

Status ChromiumPipe::open(const fs::path& page, const std::string& query, bool isLight) {
  const Result<json> themed = call(
      "Emulation.setEmulatedMedia",
      {{"features", {{{"name", "prefers-color-scheme"}, {"value", isLight ? "light" : "dark"}}}}});
  if (!themed) return themed.error();
  const Result<json> went = call("Page.navigate", {{"url", addressOf(page) + "?" + query}});
  if (!went) return went.error();
  if (const std::string failure = went->value("errorText", std::string()); !failure.empty())
    return Error{"cannot open the page: " + failure};
  return std::monostate{};
}

Result<std::uint64_t> ChromiumPipe::ask(const std::string& script) {
  return send("Runtime.evaluate",
              {{"expression", script}, {"awaitPromise", true}, {"returnByValue", true}});
}

Result<json> ChromiumPipe::answer(std::uint64_t number) {
  Result<json> result = receive(number);
  if (!result) return result;
  if (const auto thrown = result->find("exceptionDetails"); thrown != result->end()) {
    const json exception = thrown->value("exception", json::object());
    std::string what = exception.value("description", thrown->value("text", std::string()));
    return Error{"says: " + what.substr(0, what.find('\n'))};
  }
  json& value = (*result)["result"]["value"];
  return std::move(value);
}

Result<json> ChromiumPipe::run(const std::string& script) {
  const Result<std::uint64_t> number = ask(script);
  if (!number) return number.error();
  return answer(*number);
}

Result<std::uint64_t> ChromiumPipe::send(const std::string& method, json parameters) {
  json message = {{"id", ++number_}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) message["sessionId"] = session_;
  std::string text = message.dump(-1, ' ', false, json::error_handler_t::replace);
  text += '\0';
  if (!sendAll(connection_, std::as_bytes(std::span(text)))) return ended();
  return number_;
}

Result<json> ChromiumPipe::call(const std::string& method, json parameters) {
  const Result<std::uint64_t> number = send(method, std::move(parameters));
  if (!number) return number.error();
  return receive(*number);
}

/// Returns the result of a message; all others that come before are of no use, as one is asked for
/// after the other.
Result<json> ChromiumPipe::receive(std::uint64_t number) {
  while (true) {
    Result<json> message = nextMessage();
    if (!message) return message;
    if (message->value("method", std::string()) == "Inspector.targetCrashed")
      return Error{"has lost its page; expected more memory for it"};
    if (message->value("id", std::uint64_t{0}) != number) continue;
    if (const auto fault = message->find("error"); fault != message->end())
      return Error{"refuses: " + fault->value("message", std::string())};
    return std::move((*message)["result"]);
  }
}

Result<json> ChromiumPipe::nextMessage() {
  std::size_t looked = 0;
  std::size_t end = std::string::npos;
  while ((end = rest_.find('\0', looked)) == std::string::npos) {
    looked = rest_.size();
    pollfd waited = {connection_.number(), POLLIN, 0};
    const int ready = poll(&waited, 1, kPatience);
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) return Error{"has not answered for five minutes"};
    rest_.resize(looked + kPortion);
    const ssize_t got = recv(connection_.number(), rest_.data() + looked, kPortion, 0);
    rest_.resize(looked + static_cast<std::size_t>(got > 0 ? got : 0));
    if (got <= 0 && !(got < 0 && errno == EINTR)) return ended();
  }
  json message =
      json::parse(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
  rest_.erase(0, end + 1);
  if (!message.is_object()) return Error{"answers what is no JSON"};
  return message;
}

Error ChromiumPipe::ended() const {
  const std::string words = lastLine(messages_);
  return Error{"has ended" + (words.empty() ? "" : ": " + words)};
}

}  // namespace carom::lab

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

#include "audio/io/byte_file.h"
#include "audio/propagation/sofa_file.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

/// The default head, which every build of the library has beside it: a whole file, of 1.2 MB.
const std::vector<std::byte>& wholeFile() {
  static const auto file = audio::readBytes(audio::defaultSofaFile());
  require(static_cast<bool>(file));
  return *file;
}

// First bytes of inputs: the file is cut, words of it are changed, there is none.
constexpr std::uint8_t kCut = 255;
constexpr std::uint8_t kWords = 254;
constexpr std::uint8_t kNoFile = 253;

/// Where in the file what it says of itself begins: its convention, its units, its sizes.
const std::vector<std::size_t>& wordsOfFile() {
  static const std::vector<std::size_t> places = [] {
    const auto& bytes = wholeFile();
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::vector<std::size_t> found;
    for (const std::string_view word :
         {"SimpleFreeFieldHRIR", "FIR", "hertz", "spherical", "cartesian", "Units", "Type", "TREE"})
      for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1))
        found.push_back(at);
    return found;
  }();
  return places;
}

/// Changes up to 32 bytes, at places that five bytes of the fuzzer name with their value; most in
/// the first and the last 16 kB, where the structure of the file is. If its first byte is `kCut`,
/// it cuts the file; if `kWords`, it changes words.
std::vector<std::byte> damaged(FuzzNumbers& numbers) {
  std::vector<std::byte> bytes = wholeFile();
  const std::uint8_t first = numbers.byte();
  const bool isCut = first == kCut;
  for (int change = 0; change < 32 && !numbers.isEmpty(); ++change) {
    const std::size_t kind = numbers.below(4);
    const std::size_t place = numbers.byte() * 65536U + numbers.byte() * 256U + numbers.byte();
    if (first == kWords) {
      const std::size_t at = wordsOfFile()[place % wordsOfFile().size()] + kind;
      bytes[std::min(at, bytes.size() - 1)] = std::byte{numbers.byte()};
      continue;
    }
    const std::size_t near = place % std::min<std::size_t>(16384, bytes.size());
    const std::size_t at = kind == 0   ? place % bytes.size()
                           : kind == 1 ? bytes.size() - 1 - near
                                       : near;
    bytes[at] = std::byte{numbers.byte()};
    if (isCut && change == 0) bytes.resize(at + 1);
  }
  return bytes;
}

void write(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
}

}  // namespace
}  // namespace carom::fuzz

/// Reads a whole SOFA file in which some bytes were changed, or, if the input begins as such a file
/// does, the input itself: measurements or one sentence with the file's name must come of it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using carom::fuzz::require;
  const std::span bytes(data, size);
  carom::fuzz::FuzzNumbers numbers(bytes);
  const bool isFile = size >= 4 && data[0] == 0x89 && data[1] == 'H' && data[2] == 'D';
  std::filesystem::path file = carom::fuzz::scratchFolder() / "fuzz.sofa";
  if (size == 2 && data[0] == carom::fuzz::kNoFile)
    file = data[1] % 2 == 0 ? carom::fuzz::scratchFolder() : file / "nothing";
  else if (isFile)
    carom::fuzz::write(file, std::as_bytes(bytes));
  else
    carom::fuzz::write(file, carom::fuzz::damaged(numbers));
  const auto read = carom::audio::readSofaFile(file);
  if (read) {
    require(!read->items.empty());
    return 0;
  }
  const std::string_view message = read.error().message;
  require(message.starts_with("SOFA file '" + file.string() + "': "));
  require(message.find('\n') == message.npos);
  return 0;
}

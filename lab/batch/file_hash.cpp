#include "lab/batch/file_hash.h"

#include <array>
#include <cstddef>
#include <fstream>
#include <new>
#include <system_error>
#include <vector>

#include <openssl/evp.h>

namespace carom::lab {
namespace {

EVP_MD_CTX* contextOf(void* context) {
  return static_cast<EVP_MD_CTX*>(context);
}

/// The method, looked up once: OpenSSL 3 takes longer for that than for a small file.
const EVP_MD* method() {
  static const EVP_MD* const found = EVP_MD_fetch(nullptr, "SHA256", nullptr);
  return found;
}

}  // namespace

void FileHash::Free::operator()(void* context) const {
  EVP_MD_CTX_free(contextOf(context));
}

// OpenSSL fails here where memory lacks, and nowhere else.
FileHash::FileHash() : context_(EVP_MD_CTX_new()) {
  if (context_ == nullptr || EVP_DigestInit_ex2(contextOf(context_.get()), method(), nullptr) != 1)
    throw std::bad_alloc();
}

void FileHash::add(std::span<const std::byte> bytes) {
  EVP_DigestUpdate(contextOf(context_.get()), bytes.data(), bytes.size());
}

void FileHash::add(std::string_view text) {
  add(std::as_bytes(std::span(text)));
}

std::string FileHash::digits() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> hash{};
  unsigned int size = 0;
  EVP_DigestFinal_ex(contextOf(context_.get()), hash.data(), &size);
  std::string text;
  for (unsigned int at = 0; at < size; ++at) {
    text += "0123456789abcdef"[hash[at] >> 4U];
    text += "0123456789abcdef"[hash[at] & 15U];
  }
  return text;
}

std::string sha256(std::string_view text) {
  return sha256(std::as_bytes(std::span(text)));
}

std::string sha256(std::span<const std::byte> bytes) {
  FileHash hash;
  hash.add(bytes);
  return hash.digits();
}

Result<std::string> sha256OfFile(const std::filesystem::path& file) {
  // A device may have no end, and a pipe no beginning.
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed))
    return Error{"is no regular file; expected one that may be read"};
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return Error{"cannot be opened; expected a file that may be read"};
  FileHash hash;
  std::vector<char> buffer(std::size_t{1} << 16U);
  while (stream) {
    stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash.add(std::string_view(buffer.data(), static_cast<std::size_t>(stream.gcount())));
  }
  if (stream.bad()) return Error{"cannot be read to its end"};
  return hash.digits();
}

}  // namespace carom::lab

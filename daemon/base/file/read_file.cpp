#include "daemon/base/file/read_file.hpp"

#include <fstream>
#include <sstream>

namespace weft::daemon {

Result<std::string> read_text_file(const std::filesystem::path& path, std::uintmax_t max_bytes) {
  auto text = read_file(path, max_bytes);
  // Parsers of JSON take it for the end of the text, and what stands behind it for nothing.
  if (text && text->find('\0') != std::string::npos)
    return fail({.code = Errc::parse, .where = path, .what = "a zero byte: not a text file"});
  return text;
}

Result<std::string> read_file(const std::filesystem::path& path, std::uintmax_t max_bytes) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error)
    return fail({.code = Errc::not_found,
                 .where = path,
                 .what = "cannot read the file",
                 .got = error.message()});
  if (size > max_bytes)
    return fail({.code = Errc::range,
                 .where = path,
                 .what = "file too large",
                 .expected = "at most " + std::to_string(max_bytes) + " bytes",
                 .got = std::to_string(size) + " bytes"});
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return fail({.code = Errc::io, .where = path, .what = "cannot read the file"});
  return std::move(text).str();
}

}  // namespace weft::daemon

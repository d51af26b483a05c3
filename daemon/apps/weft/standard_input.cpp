#include "daemon/apps/weft/standard_input.hpp"

#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <istream>
#include <string>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";
constexpr std::size_t most_bytes = std::size_t{4} << 30;

Result<std::string> read_to_end(std::istream& in) {
  std::string text;
  std::array<char, 1 << 16> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > most_bytes)
      return fail({.code = Errc::range,
                   .what = "too much on standard input",
                   .expected = "at most 4 GiB",
                   .hint = "Give a data set by its file name"});
  }
  if (text.empty())
    return fail({.code = Errc::not_found,
                 .what = "nothing on standard input",
                 .expected = "a trial (CSV) or a data set"});
  return text;
}

// A file that is gone when this is.
class TemporaryFile {
 public:
  TemporaryFile()
      : path_((std::filesystem::temp_directory_path() / "weft-stdin-XXXXXX").string()),
        handle_(::mkstemp(path_.data())) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (handle_ < 0) return;
    ::close(handle_);
    std::error_code gone;
    std::filesystem::remove(path_, gone);
  }
  [[nodiscard]] bool write(const std::string& bytes) const {
    return handle_ >= 0 && (std::ofstream(path_, std::ios::binary) << bytes).flush().good();
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  int handle_;
};

Result<Dataset> read_dataset(const std::string& bytes) {
  const TemporaryFile file;
  if (!file.write(bytes))
    return fail({.code = Errc::io,
                 .where = file.path(),
                 .what = "cannot keep a data set from standard input",
                 .hint = "HDF5 needs a file: is the folder for temporary files full?"});
  auto dataset = read_hdf5(file.path());
  if (!dataset) return pass(dataset.error(), standard_input_name);
  return dataset;
}

}  // namespace

Result<Dataset> trials_from(std::istream* in) {
  if (in == nullptr) return fail({.code = Errc::unsupported, .what = "no standard input here"});
  auto text = read_to_end(*in);
  if (!text) return pass(text.error());
  if (text->starts_with(hdf5_signature)) return read_dataset(*text);
  return import_trial_text(standard_input_name, std::move(*text));
}

}  // namespace weft::daemon::cli

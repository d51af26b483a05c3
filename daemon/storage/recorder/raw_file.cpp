#include "daemon/storage/recorder/raw_file.hpp"

#include <algorithm>
#include <limits>

namespace weft::daemon::sqlite {

Result<RawFile> RawFile::open(const std::filesystem::path& path) {
  auto database = Database::open_untouched(path);
  if (!database) return pass(database.error());
  sqlite3_file* file = database->file();
  if (file == nullptr || file->pMethods == nullptr)
    return fail({.code = Errc::io, .where = path.string(), .what = "cannot read the file"});
  return RawFile(std::move(*database), file);
}

Result<std::size_t> RawFile::read(std::uint64_t at, std::span<std::uint8_t> to) const {
  sqlite3_int64 bytes = 0;
  if (file_->pMethods->xFileSize(file_, &bytes) != SQLITE_OK)
    return fail({.code = Errc::io, .what = "cannot tell the file's size"});
  const auto size = static_cast<std::uint64_t>(bytes);
  const std::size_t there =
      at >= size ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), size - at));
  std::fill(to.begin() + static_cast<std::ptrdiff_t>(there), to.end(), std::uint8_t{0});
  if (there == 0) return there;
  if (there > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      file_->pMethods->xRead(file_, to.data(), static_cast<int>(there),
                             static_cast<sqlite3_int64>(at)) != SQLITE_OK)
    return fail({.code = Errc::io, .what = "the file cannot be read to its end"});
  return there;
}

bool RawFile::fill(std::uint64_t at, std::span<std::uint8_t> to) const {
  const auto got = read(at, to);
  return got && *got == to.size();
}

}  // namespace weft::daemon::sqlite

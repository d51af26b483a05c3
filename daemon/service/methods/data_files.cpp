#include "daemon/service/methods/data_files.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/handover_file.hpp"

namespace weft::daemon::api {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_lists = 64;      // cached lists
constexpr std::size_t most_digests = 4096;  // cached digests
constexpr std::size_t piece_bytes = std::size_t{1} << 20;
// A file modified just now may change again within the same tick of the kernel's clock.
constexpr std::int64_t tick_ns = 1'000'000'000;

/// One path component that is not hidden, so that no list can refer to another folder.
bool is_plain(std::string_view name) {
  return !name.empty() && !name.starts_with('.') && name.find('/') == std::string_view::npos;
}

/// Opened from the parent folder, so that the run's folder may not be a link either.
Result<OpenFile> opened(const fs::path& folder, const fs::path& name) {
  return OpenFile::beneath(folder.parent_path(), folder.filename() / name);
}

fs::path evaluation_name() {
  return fs::path(handover_folder_name) / evaluation_file_name;
}

fs::path exports_name() {
  return fs::path(export_folder_name) / export_list_name;
}

std::optional<OpenFile::Stamp> read_stamp(const fs::path& folder, const fs::path& name) {
  const auto file = opened(folder, name);
  const auto stamp = file ? file->stamp() : pass(file.error());
  return stamp ? std::optional(*stamp) : std::nullopt;
}

/// The list itself can be fetched too.
Status add_list(const fs::path& folder, const std::string& name, std::vector<DataFile>& out) {
  const auto text = read_text_file(folder / name, most_list_bytes);
  if (!text) return pass(text.error());
  out.push_back({name, text->size(), sha256_hex(*text)});
  return {};
}

std::string in_folder(const char* folder, const std::string& name) {
  return std::string(folder) + "/" + name;
}

Status add_certified(const fs::path& folder, const Certificate& certificate,
                     std::vector<DataFile>& out) {
  if (Status ok = add_list(folder, certificate_file_name, out); !ok) return ok;
  for (const FileChecksums& file : certificate.files)
    if (is_plain(file.name)) out.push_back({file.name, file.bytes, file.sha256});
  const auto handover_files = listed_handover_files(folder);
  if (!handover_files)
    return {};  // verify reports a damaged list; the data files can still be listed
  for (const FileChecksums& file : *handover_files)
    if (is_plain(file.name))
      out.push_back({in_folder(handover_folder_name, file.name), file.bytes, file.sha256});
  if (!handover_files->empty())
    static_cast<void>(add_list(folder, evaluation_name().string(), out));
  return {};
}

Result<std::vector<DataFile>> read_lists(const fs::path& folder) {
  const auto certificate = read_certificate(folder);
  if (!certificate) return pass(certificate.error());
  const auto exported = listed_exports(folder);  // a damaged list is ignored here too
  const bool nothing_exported = !exported || exported->empty();
  if (!*certificate && nothing_exported)
    return fail(
        {.code = Errc::not_found,
         .where = folder.string(),
         .what = "run without certificate",
         .hint =
             "Wait until the campaign has ended, or export the complete trials with data.export"});
  std::vector<DataFile> out;
  if (*certificate)
    if (Status ok = add_certified(folder, **certificate, out); !ok) return pass(ok.error());
  if (nothing_exported) return out;
  for (const ExportedFile& file : *exported)
    if (is_plain(file.name))
      out.push_back({in_folder(export_folder_name, file.name), file.bytes, file.sha256});
  static_cast<void>(add_list(folder, exports_name().string(), out));
  return out;
}

tl::unexpected<Error> not_as_listed(const DataFile& listed, std::string expected, std::string got) {
  return fail({.code = Errc::wrong_state,
               .where = listed.name,
               .what = "file differs from its entry in the list",
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = "Find the differences with weft verify"});
}

}  // namespace

bool DataFiles::is_settled(const Stamp& stamp) const {
  return utc_now_().count() - stamp.changed_ns > tick_ns;
}

DataFiles::Stamps DataFiles::read_stamps(const fs::path& folder) {
  return {read_stamp(folder, certificate_file_name), read_stamp(folder, evaluation_name()),
          read_stamp(folder, exports_name())};
}

Result<std::vector<DataFile>> DataFiles::list(const fs::path& folder) {
  const Stamps as_of = read_stamps(folder);
  const auto known = lists_.find(folder);
  if (known != lists_.end() && known->second.as_of == as_of) return known->second.files;
  ++work_.lists_read;
  // Evaluated before reading: a write within the tick of the stamp would go unnoticed.
  const bool settled = std::ranges::all_of(
      as_of, [this](const auto& stamp) { return !stamp || is_settled(*stamp); });
  auto files = read_lists(folder);
  if (!files) return files;
  if (lists_.size() >= most_lists) lists_.clear();
  if (settled && read_stamps(folder) == as_of) lists_[folder] = {as_of, *files};
  return files;
}

Result<std::string> DataFiles::compute_digest(const OpenFile& file, const Stamp& as_of) {
  const std::pair place(as_of.device, as_of.inode);
  const auto known = hashed_.find(place);
  if (known != hashed_.end() && known->second.as_of == as_of) return known->second.sha256;
  ++work_.files_hashed;
  const bool settled = is_settled(as_of);
  Bytes piece(piece_bytes);
  Sha256 hash;
  for (std::uint64_t at = 0; at < as_of.bytes; at += piece.size()) {
    if (stop_requested_ && stop_requested_()) return pass(stopped_early("the file's digest"));
    piece.resize(std::min<std::uint64_t>(piece_bytes, as_of.bytes - at));
    if (Status ok = file.read(at, piece); !ok) return pass(ok.error());
    hash.update(piece);
  }
  std::string found = to_hex(hash.finish());
  if (hashed_.size() >= most_digests) hashed_.clear();
  if (settled) hashed_[place] = {as_of, found};
  return found;
}

Result<server::ServedFile> DataFiles::open(const fs::path& folder, const std::string& name) {
  const auto files = list(folder);
  if (!files) return pass(files.error());
  const auto listed = std::ranges::find(*files, name, &DataFile::name);
  if (listed == files->end())
    return fail({.code = Errc::not_found,
                 .where = folder.filename().string(),
                 .what = "run has no such file",
                 .got = name.substr(0, 100),
                 .hint = "List its files with data.get"});
  auto file = opened(folder, name);
  if (!file) return not_as_listed(*listed, {}, to_string(file.error()));
  const auto as_of = file->stamp();
  if (!as_of) return pass(as_of.error());
  if (as_of->bytes != listed->bytes)
    return not_as_listed(*listed, std::to_string(listed->bytes) + " bytes",
                         std::to_string(as_of->bytes) + " bytes");
  const auto found = compute_digest(*file, *as_of);
  if (!found) return pass(found.error());
  if (*found != listed->sha256) return not_as_listed(*listed, listed->sha256, *found);
  return server::ServedFile{std::make_shared<const OpenFile>(std::move(*file)), *as_of,
                            listed->sha256};
}

}  // namespace weft::daemon::api

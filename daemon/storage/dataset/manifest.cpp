#include "daemon/storage/dataset/manifest.hpp"

#include <map>

#include "daemon/base/text/utf8.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

struct ManifestColumns {
  std::size_t file = 0;
  std::size_t label = 0;
  std::optional<std::size_t> group;
};

Result<ManifestColumns> read_columns(const CsvReader& manifest) {
  for (const std::string& name : manifest.header())
    if (name != "file" && name != "label" && name != "group")
      return manifest.complaint("unknown column '" + name.substr(0, 40) + "'",
                                "file, label and perhaps group");
  const auto file = find_column(manifest, "file");
  const auto label = find_column(manifest, "label");
  if (!file || !label)
    return manifest.complaint(std::string("the column ") + (file ? "label" : "file") +
                              " is missing");
  return ManifestColumns{*file, *label, find_column(manifest, "group")};
}

/// Quotes keep blanks, and a name of nothing else cannot be told from none.
bool is_blank(std::string_view name) {
  return name.find_first_not_of(" \t") == std::string_view::npos;
}

/// One name for a file however it is written, links followed.
std::filesystem::path one_name(const std::filesystem::path& path) {
  std::error_code unseen;
  const auto canonical = std::filesystem::weakly_canonical(path, unseen);
  return unseen ? path.lexically_normal() : canonical;
}

/// Where each file is listed, by one_name().
using SeenFiles = std::map<std::filesystem::path, std::string>;

/// The manifest's current line.
Result<ManifestEntry> read_entry(const CsvReader& manifest, const ManifestColumns& columns,
                                 const std::filesystem::path& folder, SeenFiles& seen) {
  ManifestEntry out;
  out.file = manifest.fields()[columns.file];
  out.label = manifest.fields()[columns.label];
  if (columns.group) out.group = manifest.fields()[*columns.group];
  if (is_blank(out.file)) return manifest.complaint("the file name is empty");
  if (is_blank(out.label)) return manifest.complaint("the label is empty");
  for (const std::string* name : {&out.file, &out.label, &out.group})
    if (!is_utf8(*name)) return manifest.complaint("a name is not UTF-8", "UTF-8 text");
  out.path = (folder / out.file).lexically_normal();
  out.where = manifest.where();
  const auto [first, is_new] =
      seen.emplace(one_name(out.path), out.where + " as '" + out.file + "'");
  if (is_new) return out;
  return fail({.code = Errc::parse,
               .where = out.where,
               .what = "the file is listed twice",
               .got = out.file,
               .hint = "It stands in " + first->second + " already"});
}

}  // namespace

Result<std::vector<ManifestEntry>> read_manifest(const std::filesystem::path& path) {
  auto manifest = CsvReader::open(path);
  if (!manifest) return pass(std::move(manifest).error());
  const auto columns = read_columns(*manifest);
  if (!columns) return pass(columns.error());
  std::vector<ManifestEntry> out;
  SeenFiles seen;
  auto more = manifest->next();
  for (; more && *more; more = manifest->next()) {
    auto entry = read_entry(*manifest, *columns, path.parent_path(), seen);
    if (!entry) return pass(std::move(entry).error());
    out.push_back(std::move(*entry));
  }
  if (!more) return pass(std::move(more).error());
  if (out.empty()) return manifest->complaint("a header but no trials");
  return out;
}

}  // namespace weft::daemon

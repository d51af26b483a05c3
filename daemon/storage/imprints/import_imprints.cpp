#include "daemon/storage/imprints/import_imprints.hpp"

#include <algorithm>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/csv.hpp"
#include "daemon/base/text/utf8.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/manifest.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/imprints/number_lines.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;

Dataset imported_set(const std::filesystem::path& path, std::string source) {
  Dataset out;
  out.info.name = path.stem().string();
  out.info.source = std::move(source);
  out.info.software_version = software_version();
  return out;
}

Status import_table_line(NumberLines& lines, std::size_t rows, std::size_t cols, Dataset& dataset) {
  constexpr std::size_t words = 2;
  if (lines.fields().size() != words + rows * cols)
    return fail({.code = Errc::parse,
                 .where = lines.where(),
                 .what = "wrong number of fields",
                 .expected = "label, group and " + std::to_string(rows * cols) + " values",
                 .got = std::to_string(lines.fields().size())});
  const std::string label(lines.fields()[0]), group(lines.fields()[1]);
  if (label.empty())
    return fail({.code = Errc::parse, .where = lines.where(), .what = "the label is empty"});
  if (!is_utf8(label) || !is_utf8(group))
    return fail({.code = Errc::parse,
                 .where = lines.where(),
                 .what = "a name is not UTF-8",
                 .expected = "UTF-8 text"});
  Image image(rows, cols);
  for (std::size_t i = 0; i < rows * cols; ++i) {
    const auto value = lines.number(words + i);
    if (!value) return pass(value.error());
    image.data()[i] = *value;
  }
  auto done = append_imprint(dataset, image,
                             label + "/" + group + "#" + std::to_string(dataset.trials.size()),
                             label, group);
  if (!done) return pass(std::move(done).error(), lines.where());
  return {};
}

}  // namespace

Result<Dataset> import_imprints(const std::filesystem::path& manifest) {
  const auto entries = read_manifest(manifest);
  if (!entries) return pass(entries.error());
  Dataset out = imported_set(manifest, "imprints");
  for (const ManifestEntry& entry : *entries) {
    const auto image = read_image(entry.path);
    if (!image) return pass(image.error(), entry.where);
    auto done = append_imprint(out, *image, entry.file, entry.label, entry.group);
    if (!done) return pass(std::move(done).error(), entry.where);
  }
  if (auto ok = check(out); !ok) return pass(ok.error(), manifest.string());
  return out;
}

Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols) {
  if (rows == 0 || cols == 0 || rows > classifier::imprint::most_taxels / cols)
    return fail({.code = Errc::range,
                 .where = "--shape",
                 .what = "no imprint has this size",
                 .expected = "28x50",
                 .got = std::to_string(rows) + "x" + std::to_string(cols)});
  const auto text = read_text_file(table, most_image_bytes);
  if (!text) return pass(text.error());
  NumberLines lines(table.string(), *text);
  Dataset out = imported_set(table, "imprint-table");
  bool first = true;
  while (lines.next()) {
    const bool heading = first && !lines.is_number(2);
    first = false;
    if (heading) continue;
    if (auto done = import_table_line(lines, rows, cols, out); !done) return pass(done.error());
  }
  if (auto ok = lines.check_end(); !ok) return pass(ok.error());
  if (out.trials.empty())
    return fail({.code = Errc::parse, .where = table.string(), .what = "no imprint in the table"});
  if (auto ok = check(out); !ok) return pass(ok.error(), table.string());
  return out;
}

}  // namespace weft::daemon

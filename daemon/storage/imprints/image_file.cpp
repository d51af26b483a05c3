#include "daemon/storage/imprints/image_file.hpp"

#include <algorithm>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/imprints/number_lines.hpp"

namespace weft::daemon {

using classifier::imprint::Image;

Result<Image> read_image(const std::filesystem::path& path) {
  const std::string kind = path.extension().string(), name = path.string();
  if (kind != ".csv" && kind != ".txt" && kind != ".pgm" && kind != ".npy")
    return fail({.code = Errc::unsupported,
                 .where = name,
                 .what = "imprints are not read from such files",
                 .expected = ".csv, .txt, .pgm or .npy",
                 .got = kind});
  const auto text = read_file(path, most_image_bytes);
  if (!text) return pass(text.error());
  auto image = kind == ".pgm"   ? parse_image_pgm(name, *text)
               : kind == ".npy" ? parse_image_npy(name, *text)
                                : parse_image_csv(name, *text);
  if (!image) return pass(image.error());
  if (auto ok = classifier::imprint::check(*image); !ok) return pass(ok.error(), name);
  return image;
}

using classifier::imprint::Image;

Result<Image> parse_image_csv(const std::string& name, std::string_view text) {
  NumberLines lines(name, text);
  std::vector<double> values;
  std::size_t rows = 0, cols = 0;
  while (lines.next()) {
    if (rows == 0) cols = lines.fields().size();
    if (lines.fields().size() != cols)
      return fail({.code = Errc::parse,
                   .where = lines.where(),
                   .what = "rows of different length",
                   .expected = std::to_string(cols),
                   .got = std::to_string(lines.fields().size())});
    if (values.size() + cols > classifier::imprint::most_taxels)
      return fail({.code = Errc::range, .where = lines.where(), .what = "too many taxels"});
    for (std::size_t c = 0; c < cols; ++c) {
      const auto value = lines.number(c);
      if (!value) return pass(value.error());
      values.push_back(*value);
    }
    ++rows;
  }
  if (auto ok = lines.check_end(); !ok) return pass(ok.error());
  if (rows == 0)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "the file holds no imprint",
                 .expected = "rows of numbers"});
  Image out(rows, cols);
  std::copy(values.begin(), values.end(), out.data().begin());
  return out;
}

}  // namespace weft::daemon

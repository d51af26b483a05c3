#include "daemon/storage/imprints/image_file.hpp"

#include "daemon/base/file/read_file.hpp"

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

}  // namespace weft::daemon

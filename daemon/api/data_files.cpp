#include "daemon/api/data_files.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/certificate/certificate.hpp"
#include "daemon/dataset/sha256.hpp"
#include "daemon/handover/hand_over_file.hpp"
#include "daemon/run/rig_file.hpp"

namespace weft::daemon::api {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t most_list_bytes = std::uintmax_t{1} << 28;

/// One path component, nothing hidden: whatever a list says, no other folder is reached.
bool is_plain(std::string_view name) {
  return !name.empty() && !name.starts_with('.') && name.find('/') == std::string_view::npos;
}

/// A list is a file as well.
Status add_list(const fs::path& folder, const std::string& name, std::vector<DataFile>& out) {
  const auto text = read_text_file(folder / name, most_list_bytes);
  if (!text) return pass(text.error());
  out.push_back({name, text->size(), sha256_hex(*text)});
  return {};
}

}  // namespace

Result<std::vector<DataFile>> data_files(const fs::path& folder) {
  const auto certificate = read_certificate(folder);
  if (!certificate) return pass(certificate.error());
  if (!*certificate)
    return fail(Errc::not_found, "this run has no certificate", folder.string(), {}, {},
                "It is written when a campaign ends");
  std::vector<DataFile> out;
  if (Status ok = add_list(folder, certificate_file_name, out); !ok) return pass(ok.error());
  for (const FilePrint& file : (*certificate)->files)
    if (is_plain(file.name)) out.push_back({file.name, file.bytes, file.sha256});
  const auto handed = listed_hand_over_files(folder);
  if (!handed) return out;  // a damaged one is told by verify; the data are there all the same
  for (const HandOverFile& file : *handed)
    if (is_plain(file.name))
      out.push_back(
          {std::string(hand_over_folder_name) + "/" + file.name, file.bytes, file.sha256});
  if (!handed->empty())
    static_cast<void>(
        add_list(folder, std::string(hand_over_folder_name) + "/" + evaluation_file_name, out));
  return out;
}

Result<server::ServedFile> served_file(const control::RunDesk& desk, std::string_view path) {
  const std::size_t slash = path.find('/');
  const std::string_view id = path.substr(0, slash);
  const auto run = desk.get(id);
  if (!run) return pass(run.error());
  const std::string_view name = slash == std::string_view::npos ? "" : path.substr(slash + 1);
  const auto files = data_files(run->stored.folder);
  if (!files) return pass(files.error());
  const auto found = std::ranges::find(*files, name, &DataFile::name);
  if (found == files->end())
    return fail(Errc::not_found, "no such file of that run", std::string(id), {},
                std::string(name.substr(0, 100)), "data.get lists them");
  const fs::path file = run->stored.folder / found->name;
  std::error_code error;
  if (fs::is_symlink(file, error) || fs::file_size(file, error) != found->bytes || error)
    return fail(Errc::wrong_state, "the file is not what its list says", found->name,
                std::to_string(found->bytes) + " bytes", {}, "weft verify tells what differs");
  return server::ServedFile{file, found->bytes, found->sha256};
}

}  // namespace weft::daemon::api

#include "daemon/apps/weft/page_files.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::uintmax_t most_record_bytes = std::uintmax_t{1} << 30;

bool is_record(std::string_view text) {
  const auto record = nlohmann::ordered_json::parse(text, nullptr, false);
  return is_report_json(text) || (record.is_object() && record.contains("page"));
}

}  // namespace

std::filesystem::path record_beside(const std::filesystem::path& html) {
  return std::filesystem::path(html).replace_extension(".json");
}

Status check_page(std::span<const std::filesystem::path> inputs,
                  const std::filesystem::path& html) {
  if (html.empty()) return {};
  if (html.extension() == ".json")
    return fail({.code = Errc::invalid_argument,
                 .where = "-o",
                 .what = "page has the name of its record",
                 .expected = "a name that ends in .html",
                 .got = html.string(),
                 .hint = "Choose another ending; the record is written beside the page, as .json"});
  const std::filesystem::path record = record_beside(html);
  for (const auto& output : {html, record}) {
    for (const auto& input : inputs)
      if (Status ok = refuse_same_file(input, output); !ok) return ok;
    if (Status ok = check_output(output); !ok) return ok;
  }
  std::error_code unseen;
  if (!std::filesystem::exists(record, unseen)) return {};
  const auto there = read_text_file(record, most_record_bytes);
  if (there && is_record(*there)) return {};
  return fail({.code = Errc::invalid_argument,
               .where = record.string(),
               .what = "record of the page would replace another file",
               .expected = "no file, or a JSON object with the key \"page\"",
               .hint = "Choose another name for the page"});
}

Status check_page(const std::filesystem::path& input, const std::filesystem::path& html) {
  return check_page(std::span(&input, 1), html);
}

Status write_page_files(const std::filesystem::path& html, const nlohmann::ordered_json& record,
                        const Document& document) {
  return html.empty() ? Status{} : write_page(html, record, document);
}

Status draw_record(const std::filesystem::path& record, const std::filesystem::path& html) {
  const auto text = read_text_file(record, most_record_bytes);
  if (!text) return pass(text.error());
  const auto page = page_of_record(*text);
  if (!page) return pass(page.error(), record.string());
  return write_text_file(html, *page);
}

Status open_page(const std::filesystem::path& html) {
  std::string program = "xdg-open", file = std::filesystem::absolute(html).string();
  const std::array<char*, 3> arguments{program.data(), file.data(), nullptr};
  pid_t child = 0;
  if (::posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0)
    return fail({.code = Errc::not_found,
                 .where = "--open",
                 .what = "program xdg-open not found",
                 .hint = "Open " + file + " in a browser, or install xdg-utils"});
  int status = 0;
  if (::waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return fail({.code = Errc::io,
                 .where = "--open",
                 .what = "xdg-open failed",
                 .expected = "exit status 0",
                 .got = std::to_string(WIFEXITED(status) ? WEXITSTATUS(status) : -1),
                 .hint = "Open " + file + " in a browser"});
  return {};
}

}  // namespace weft::daemon::cli

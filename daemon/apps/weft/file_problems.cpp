#include "daemon/apps/weft/file_problems.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

namespace weft::daemon::cli {
namespace {

using nlohmann::json;
using recipes::Diagnostic;

Error refusal(const std::filesystem::path& file, const std::vector<FileProblem>& problems) {
  const auto count =
      std::ranges::count_if(problems, [&](const FileProblem& p) { return p.file == file; });
  return {.code = Errc::invalid_argument,
          .where = file.string(),
          .what = "the file is refused",
          .expected = "no problem",
          .got = std::to_string(count) + (count == 1 ? " problem" : " problems")};
}

}  // namespace

json diagnostic_json(const Diagnostic& d) {
  return {{"pointer", d.pointer}, {"message", d.message}, {"expected", d.expected},
          {"got", d.got},         {"hint", d.hint},       {"sentence", recipes::to_string(d)}};
}

int refuse(const std::vector<FileProblem>& problems, Console& console) {
  const Error first = refusal(problems.front().file, problems);
  json object = error_json(first);
  object["problems"] = json::array();
  const std::filesystem::path* file = nullptr;
  for (const FileProblem& problem : problems) {
    if (file == nullptr || *file != problem.file)
      console.err << "weft: " << to_string(refusal(problem.file, problems)) << '\n';
    file = &problem.file;
    console.err << "  " << recipes::to_string(problem.what) << '\n';
    json one = diagnostic_json(problem.what);
    one["file"] = problem.file.string();
    object["problems"].push_back(std::move(one));
  }
  if (console.json) print(console, {}, {{"error", object}});
  return exit_failure;
}

}  // namespace weft::daemon::cli

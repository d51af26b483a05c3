#include "daemon/campaign/parts.hpp"

#include <charconv>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

constexpr std::size_t most_parts = 1'000'000;

std::optional<std::size_t> number_in(std::string_view text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "0003-denim": the number keeps folders in the order of the recipe.
std::string folder_name(std::size_t fabric, const std::string& name) {
  std::string number = std::to_string(fabric + 1);
  number.insert(0, 4 - std::min<std::size_t>(number.size(), 4), '0');
  return number + "-" + name;
}

Status require_simulated(const SettledRequest& settled, const CampaignRequest& request) {
  if (settled.rig.mode != BenchMode::simulated)
    return fail({.code = Errc::unsupported,
                 .where = request.rig.string(),
                 .what = "bench cannot run a part of a campaign",
                 .expected = "simulated",
                 .got = std::string(to_string(settled.rig.bench)),
                 .hint = "Parts are for simulated campaigns; leave --part out"});
  if (request.fidelity.times_real_time)
    return fail({.code = Errc::unsupported,
                 .where = "--budget",
                 .what = "option depends on the speed of this machine, so parts could differ",
                 .hint = "Use --accuracy instead"});
  return {};
}

Status write_part(const std::filesystem::path& out, const PartSummary& summary,
                  const SettledRequest& settled) {
  json campaigns = json::array();
  for (const PartCampaign& one : summary.campaigns)
    campaigns.push_back({{"fabric", one.fabric},
                         {"folder", one.folder},
                         {"dataset_sha256", one.dataset_sha256},
                         {"trials", one.trials}});
  const json file{{"format", "weft-part"},
                  {"version", 1},
                  {"bench", to_string(summary.bench)},
                  {"campaign", summary.name},
                  {"part", summary.part.number},
                  {"parts", summary.part.count},
                  {"seed", std::to_string(settled.checked.plan.seed)},
                  {"campaigns", std::move(campaigns)}};
  return write_text_file(out / part_file_name, file.dump(1) + "\n");
}

}  // namespace

Result<PartNumber> part_number_from(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto number = number_in(text.substr(0, slash));
  const auto count =
      slash == std::string_view::npos ? std::nullopt : number_in(text.substr(slash + 1));
  if (number && count && *number >= 1 && *number <= *count && *count <= most_parts)
    return PartNumber{*number, *count};
  return fail({.code = Errc::invalid_argument,
               .where = "--part",
               .what = "invalid part",
               .expected = "K/N with K from 1 to N, such as 2/3",
               .got = std::string(text)});
}

std::string to_string(const PartNumber& part) {
  return std::to_string(part.number) + "/" + std::to_string(part.count);
}

std::vector<std::size_t> fabrics_of(const PartNumber& part, std::size_t fabrics) {
  std::vector<std::size_t> out;
  for (std::size_t i = part.number - 1; i < fabrics; i += part.count) out.push_back(i);
  return out;
}

Result<PartSummary> run_part(const CampaignRequest& request, const PartNumber& part,
                             const PartHooks& hooks) {
  const auto settled = settled_request(request);
  if (!settled) return pass(settled.error());
  if (Status ok = require_simulated(*settled, request); !ok) return pass(ok.error());
  const recipes::Plan& plan = settled->checked.plan;
  PartSummary out;
  out.part = part;
  out.name = plan.name;
  out.bench = settled->rig.bench;
  const auto began = steady_wall_now();
  for (const std::size_t fabric : fabrics_of(part, plan.fabrics.size())) {
    CampaignRequest one = request;
    one.only_fabric = plan.fabrics[fabric];
    const std::string folder = folder_name(fabric, *one.only_fabric);
    one.out = request.out / folder;
    one.accept_whole = true;
    if (hooks.begins)
      hooks.begins(*one.only_fabric, recipes::part_on(plan, fabric).forecast.prompts);
    auto ran = run_campaign(one, hooks.campaign);
    if (!ran) return pass(ran.error());
    out.trials_planned += ran->trials_planned;
    out.virtual_s += ran->virtual_s;
    if (ran->outcome != recipes::Outcome::complete || ran->dataset_error ||
        ran->trials_complete < ran->trials_planned) {
      out.incomplete = std::move(*ran);
      break;
    }
    out.campaigns.push_back({*one.only_fabric, folder, ran->dataset_sha256, ran->trials_complete});
  }
  out.wall_s = std::chrono::duration<double>(steady_wall_now() - began).count();
  if (out.incomplete) return out;
  std::error_code error;
  std::filesystem::create_directories(request.out, error);  // of a part without fabrics
  if (Status ok = write_part(request.out, out, *settled); !ok) return pass(ok.error());
  return out;
}

}  // namespace weft::daemon

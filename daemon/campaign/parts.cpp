#include "daemon/campaign/parts.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "protocols/base/json_text.hpp"

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
                 // The data of an emulated bench is simulated, too: name the mode, not the data.
                 .got = settled.rig.mode == BenchMode::emulated ? "emulated" : "real",
                 .hint = "Parts are for simulated campaigns; leave --part out"});
  if (request.fidelity.times_real_time)
    return fail({.code = Errc::unsupported,
                 .where = "--budget",
                 .what = "option depends on the speed of this machine, so parts could differ",
                 .hint = "Use --accuracy instead"});
  const auto ends_early = [](const recipes::Exploration& one) {
    return one.live_vote && one.live_vote->stop_early;
  };
  if (std::ranges::any_of(settled.checked.plan.explorations, ends_early))
    return fail({.code = Errc::unsupported,
                 .where = request.recipe.string(),
                 .what = "parts of a campaign with stop_early cannot be merged",
                 .hint = "Remove stop_early, or run the campaign without --part"});
  return {};
}

/// Properties that identify a part in its folder.
json identity_of(const PartSummary& summary, const SettledRequest& settled) {
  return {{"format", "weft-part"},
          {"version", 1},
          {"bench", to_string(summary.bench)},
          {"campaign", summary.name},
          {"part", summary.part.number},
          {"parts", summary.part.count},
          {"seed", std::to_string(settled.checked.plan.seed)},
          {"recipe_sha256", sha256_hex(settled.checked.recipe_text)},
          {"rig_sha256", sha256_hex(settled.checked.rig_text)}};
}

/// Compares the part that the folder has, if any, with the requested one.
Status require_same_part(const std::filesystem::path& out, const json& wanted, bool resumes) {
  const std::filesystem::path file = out / part_file_name;
  std::error_code unseen;
  if (!std::filesystem::exists(file, unseen)) return {};
  const auto text = read_text_file(file, most_list_bytes);
  if (!text) return pass(text.error());
  const auto found = parse_json(*text);
  if (!found) return pass(found.error(), file.string());
  for (const auto& [key, value] : wanted.items())
    if (const json recorded = found->is_object() ? found->value(key, json()) : json();
        recorded != value)
      return fail({.code = Errc::wrong_state,
                   .where = file.string(),
                   .what = "folder has another part or campaign",
                   .expected = key + " " + value.dump(),
                   .got = recorded.dump(),
                   .hint = "Choose another folder with --out"});
  if (resumes) return {};
  return fail({.code = Errc::wrong_state,
               .where = file.string(),
               .what = "folder has this part already",
               .hint = "Continue it with --resume, or choose another folder with --out"});
}

bool is_complete(const std::filesystem::path& campaign) {
  const auto certificate = read_certificate(campaign);
  return certificate && *certificate && !(*certificate)->dataset_sha256.empty() &&
         std::ranges::count((*certificate)->trials, "complete", &CertifiedTrial::outcome) ==
             static_cast<std::ptrdiff_t>((*certificate)->trials_planned);
}

/// Renames the folder of an interrupted campaign: "0003-denim.aside-1".
Status set_folder_aside(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) return {};
  std::filesystem::path aside;
  for (int number = 1; aside.empty() || std::filesystem::exists(aside, error); ++number)
    aside = folder.string() + ".aside-" + std::to_string(number);
  std::filesystem::rename(folder, aside, error);
  if (!error) return {};
  return fail({.code = Errc::io,
               .where = folder.string(),
               .what = "folder of an interrupted campaign not renamed",
               .got = error.message()});
}

Status write_part(const std::filesystem::path& out, const PartSummary& summary, json file,
                  bool is_complete) {
  json campaigns = json::array();
  for (const PartCampaign& one : summary.campaigns)
    campaigns.push_back({{"fabric", one.fabric},
                         {"folder", one.folder},
                         {"dataset_sha256", one.dataset_sha256},
                         {"trials", one.trials}});
  file["is_complete"] = is_complete;
  file["campaigns"] = std::move(campaigns);
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
  std::error_code error;
  std::filesystem::create_directories(request.out, error);
  const auto alone = FolderLock::take(request.out);
  if (!alone) return pass(alone.error());
  const json identity = identity_of(out, *settled);
  Status ok = require_same_part(request.out, identity, request.resume);
  if (ok) ok = write_part(request.out, out, identity, false);
  if (!ok) return pass(ok.error());
  const auto began = steady_wall_now();
  for (const std::size_t fabric : fabrics_of(part, plan.fabrics.size())) {
    CampaignRequest one = request;
    one.only_fabric = plan.fabrics[fabric];
    const std::string folder = folder_name(fabric, *one.only_fabric);
    one.out = request.out / folder;
    one.resume = request.resume && is_complete(one.out);
    one.accept_whole = true;
    if (request.resume && !one.resume)
      if (Status aside = set_folder_aside(one.out); !aside) return pass(aside.error());
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
    out.is_promise_missed = out.is_promise_missed || is_promise_missed(ran->simulation);
    out.campaigns.push_back({*one.only_fabric, folder, ran->dataset_sha256, ran->trials_complete});
  }
  out.wall_s = std::chrono::duration<double>(steady_wall_now() - began).count();
  if (out.incomplete) return out;
  ok = write_part(request.out, out, identity, true);
  if (!ok) return pass(ok.error());
  return out;
}

}  // namespace weft::daemon

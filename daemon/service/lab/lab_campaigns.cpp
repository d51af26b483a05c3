#include <array>
#include <charconv>
#include <cstdio>
#include <utility>

#include "daemon/service/lab/lab_store.hpp"

namespace weft::daemon::lab {
namespace {

constexpr std::array<std::string_view, 5> part_states{"queued", "held", "done", "failed",
                                                      "cancelled"};

std::string interval_text(std::chrono::seconds duration) {
  return std::to_string(duration.count()) + " seconds";
}

std::optional<std::uint64_t> seed_of(const Rows& rows, std::size_t row, int column) {
  const auto seed = rows.optional_integer(row, column);
  return seed ? std::optional(static_cast<std::uint64_t>(*seed)) : std::nullopt;
}

PartEntry part_of(const Rows& rows, std::size_t row) {
  PartEntry part;
  part.number = rows.integer(row, 0);
  part.fabric = rows.text(row, 1);
  part.rigs = rows.texts(row, 2);
  part.state = enum_named<PartState>(part_states, rows.text(row, 3)).value_or(PartState::queued);
  part.holder = rows.text(row, 4);
  part.attempt = rows.integer(row, 5);
  part.lease_until_us = rows.optional_integer(row, 6);
  part.lease_expired = rows.flag(row, 7);
  part.run = rows.text(row, 8);
  part.dataset_sha256 = rows.text(row, 9);
  part.error = rows.text(row, 10);
  part.bench = bench_kind_from(rows.text(row, 11)).value_or(BenchKind::unknown);
  return part;
}

}  // namespace

std::string_view to_string(PartState state) {
  return part_states.at(static_cast<std::size_t>(state));
}

std::string campaign_text(std::int64_t id) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "C-%06lld", static_cast<long long>(id));
  return text.data();
}

std::optional<std::int64_t> campaign_number(std::string_view text) {
  if (text.starts_with("C-")) text.remove_prefix(2);
  std::int64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || end != text.data() + text.size() || id < 1) return std::nullopt;
  return id;
}

Result<std::optional<ClaimedPart>> LabStore::claim(std::string_view rig, const RigCapabilities& can,
                                                   std::chrono::seconds lease) {
  const auto rows =
      run("SELECT campaign, number, token, until_us, attempt, fabric, name, recipe_text,"
          " recipe_sha256, parameters, seed FROM weft.claim_part($1, $2, $3, $4)",
          rig, can.fabrics, can.refused_campaigns, interval_text(lease));
  if (!rows) return pass(rows.error());
  if (rows->size() == 0) return std::optional<ClaimedPart>();
  ClaimedPart part;
  part.lease = {rows->integer(0, 0), rows->integer(0, 1), rows->text(0, 2)};
  part.lease_until_us = rows->integer(0, 3);
  part.attempt = rows->integer(0, 4);
  part.fabric = rows->text(0, 5);
  part.campaign_name = rows->text(0, 6);
  part.recipe_text = rows->text(0, 7);
  part.recipe_sha256 = rows->text(0, 8);
  part.parameters_json = rows->text(0, 9);
  part.seed = seed_of(*rows, 0, 10);
  return part;
}

Result<RenewedLease> LabStore::renew(const PartLease& part, std::chrono::seconds lease) {
  const auto rows = run("SELECT until_us, is_cancelled FROM weft.renew_part($1, $2, $3, $4)",
                        part.campaign, part.number, part.token, interval_text(lease));
  if (!rows) return pass(rows.error());
  return RenewedLease{rows->integer(0, 0), rows->flag(0, 1)};
}

Status LabStore::finish(const PartLease& part, const PartResult& result) {
  return change("SELECT weft.finish_part($1, $2, $3, $4, $5, $6, $7)", part.campaign, part.number,
                part.token, result.is_done, result.run, result.dataset_sha256, result.error);
}

Status LabStore::give_back(const PartLease& part) {
  return change("SELECT weft.give_back_part($1, $2, $3)", part.campaign, part.number, part.token);
}

Result<std::int64_t> LabStore::submit(const CampaignRequestEntry& request) {
  std::optional<std::int64_t> seed;
  if (request.seed) seed = static_cast<std::int64_t>(*request.seed);
  const auto rows = run("SELECT weft.submit_campaign($1, $2, $3, $4, $5, $6, $7, $8)", request.name,
                        request.recipe_text, request.recipe_sha256, seed, request.parameters_json,
                        request.fabrics, request.rigs, request.key);
  if (!rows) return pass(rows.error());
  return rows->integer(0, 0);
}

Status LabStore::cancel(std::int64_t campaign) {
  return change("SELECT weft.cancel_campaign($1)", campaign);
}

Result<LabCampaign> LabStore::campaign(std::int64_t id) {
  const auto rows =
      run("SELECT name, recipe_text, recipe_sha256, parameters::text, submitted_by, seed, state,"
          " (extract(epoch FROM submitted_at) * 1000000)::bigint FROM weft.campaign WHERE id = $1",
          id);
  if (!rows) return pass(rows.error());
  if (rows->size() == 0)
    return fail({.code = Errc::not_found,
                 .where = address_.text(),
                 .what = "campaign unknown in the store",
                 .got = campaign_text(id)});
  const auto parts =
      run("SELECT p.number, p.fabric, to_json(p.rigs), p.state, p.holder, p.attempt,"
          " (extract(epoch FROM p.lease_until) * 1000000)::bigint,"
          " coalesce(p.lease_until <= clock_timestamp(), false), p.run, p.dataset_sha256, p.error,"
          " r.bench FROM weft.part p LEFT JOIN weft.rig r ON r.name = p.holder"
          " WHERE p.campaign = $1 ORDER BY p.number",
          id);
  if (!parts) return pass(parts.error());
  LabCampaign campaign;
  campaign.id = id;
  campaign.name = rows->text(0, 0);
  campaign.recipe_text = rows->text(0, 1);
  campaign.recipe_sha256 = rows->text(0, 2);
  campaign.parameters_json = rows->text(0, 3);
  campaign.submitted_by = rows->text(0, 4);
  campaign.seed = seed_of(*rows, 0, 5);
  campaign.state = rows->text(0, 6);
  campaign.submitted_us = rows->integer(0, 7);
  for (std::size_t row = 0; row < parts->size(); ++row)
    campaign.parts.push_back(part_of(*parts, row));
  return campaign;
}

}  // namespace weft::daemon::lab

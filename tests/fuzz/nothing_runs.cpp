// For the fuzz target of the daemon's lines, built with sanitizers: in place of campaigns, rigs and
// disks, which would take long to build and which its inputs never come to. The replay of the
// ordinary test suite has the real ones.

#include <nlohmann/json.hpp>

#include "daemon/certificate/certificate.hpp"
#include "daemon/certificate/export_check.hpp"
#include "daemon/certificate/exports.hpp"
#include "daemon/handover/hand_over.hpp"
#include "daemon/loop/low_priority.hpp"
#include "daemon/loop/wall_clock.hpp"
#include "daemon/plugins/driver_catalog.hpp"
#include "daemon/recorder/recorder.hpp"
#include "daemon/report/json_parts.hpp"
#include "daemon/run/campaign.hpp"
#include "daemon/run/recovery.hpp"
#include "daemon/run/resume.hpp"

namespace weft::daemon {
namespace {

tl::unexpected<Error> nothing() {
  return fail(Errc::not_found, "there is no rig", "fuzz");
}

}  // namespace

Result<CheckedRequest> check_quickly(const CampaignRequest&) {
  return nothing();
}
Result<CampaignSummary> run_campaign(const CampaignRequest&, const CampaignHooks&) {
  return nothing();
}
Result<ResumePreview> preview_resume(const CampaignRequest&, const StopAsked&) {
  return nothing();
}
Result<ResumePreview> preview_discard(const std::filesystem::path&) {
  return nothing();
}
Result<ResumePreview> preview_keep_partial(const std::filesystem::path&, const StopAsked&) {
  return nothing();
}
Status discard_campaign(const std::filesystem::path&, std::string_view) {
  return nothing();
}
Result<CampaignSummary> keep_partial(const std::filesystem::path&, std::string_view,
                                     const StopAsked&) {
  return nothing();
}
Result<bool> is_only_end_left(const std::filesystem::path&) {
  return nothing();
}
bool is_anything_left(const CampaignRequest&) {
  return false;
}
Result<std::optional<recipes::HandOver>> wanted_hand_over(const std::filesystem::path&) {
  return nothing();
}
Result<HandedOver> hand_over(const std::filesystem::path&, const HandOverHooks&) {
  return nothing();
}
nlohmann::ordered_json handed_over_json(const HandedOver&) {
  return {};
}
void take_low_priority() {}
Result<std::vector<HandOverFile>> listed_hand_over_files(const std::filesystem::path&) {
  return nothing();
}
Result<std::optional<Certificate>> read_certificate(const std::filesystem::path&) {
  return nothing();
}
Result<CampaignHeader> load_header(const std::filesystem::path&) {
  return nothing();
}
Result<VerifyReport> verify(const std::filesystem::path&, const StopAsked&) {
  return nothing();
}
double steady_wall_seconds() {
  return 0;
}
Result<LiveModels> load_live_models(const recipes::Plan&, const std::filesystem::path&) {
  return nothing();
}
std::uint64_t disk_forecast(const recipes::Plan&) {
  return 0;
}
Status check_space(const std::filesystem::path&, std::uint64_t) {
  return nothing();
}
BenchKind bench_kind_of(const std::filesystem::path&) {
  return BenchKind::unknown;
}
Result<RigFile> parse_rig_file(std::string_view) {
  return nothing();
}
Result<CampaignProgress> load_progress(const std::filesystem::path&) {
  return nothing();
}
Status check_live_models(const recipes::Plan&, const std::filesystem::path&) {
  return nothing();
}
void use_plugins(RigFile&, const std::filesystem::path&, PluginSettings) {}
Result<DriverSource> DriverCatalog::source(const std::string&) {
  return nothing();
}
nlohmann::json envelope_json(const recipes::Forecast&) {
  return {};
}
std::string_view to_string(BenchKind) {
  return "unknown";
}
std::string_view to_string(ExportFormat) {
  return {};
}
std::optional<ExportFormat> export_format_from(std::string_view) {
  return ExportFormat::hdf5;
}
Result<ExportedFile> export_campaign(const std::filesystem::path&, const ExportWish&) {
  return nothing();
}
Result<std::vector<ExportedFile>> listed_exports(const std::filesystem::path&) {
  return nothing();
}
std::string_view to_string(ExportState) {
  return {};
}
Result<std::vector<CheckedExport>> exports_now(const std::filesystem::path&) {
  return nothing();
}
Result<std::string> read_text_file(const std::filesystem::path&, std::uintmax_t) {
  return nothing();
}

}  // namespace weft::daemon

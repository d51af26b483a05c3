#pragma once
// Pages that commands write, each with the record beside it that it is drawn from.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "daemon/pages/document/document.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// Where the record of a page is: the same name with the ending .json.
std::filesystem::path record_beside(const std::filesystem::path& html);

/// Whether a page and its record may be written: refuse_same_file() and check_output() of both, and
/// where the record goes there is none, or one of an older report. Nobody named that file: it may
/// be a recipe. Asked before anything is measured. Nothing is checked where `html` is empty.
Status check_page(std::span<const std::filesystem::path> inputs, const std::filesystem::path& html);
Status check_page(const std::filesystem::path& input, const std::filesystem::path& html);

/// write_page(), or nothing where `html` is empty.
Status write_page_files(const std::filesystem::path& html, const nlohmann::ordered_json& record,
                        const Document& document);

/// Draws `record` again into `html`: the same bytes as the page that was written beside it. Errors:
/// page_of_record()'s, io.
Status draw_record(const std::filesystem::path& record, const std::filesystem::path& html);

/// Shows a page with the desktop's program (xdg-open). Errors: not_found without that program; io
/// where it fails.
Status open_page(const std::filesystem::path& html);

}  // namespace weft::daemon::cli

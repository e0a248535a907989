#include "covsplat/report/report.hpp"

#include <fmt/format.h>

#include "covsplat/report/html.hpp"
#include "covsplat/report/report_sections.hpp"

namespace covsplat {

std::string MakeReport(const ReportData& data) {
  const std::string title = EscapeHtml(data.title);
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'/>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'/>"
      "<meta name='color-scheme' content='light dark'/><title>{}</title><style>{}</style></head>\n"
      "<body><main><header><h1>{}</h1><p class='lead'>{}</p></header>\n",
      title,
      PageStyle(),
      title,
      EscapeHtml(data.subtitle));
  page += internal::TilesSection(data);
  page += internal::EventsSection(data);
  page += internal::TrajectorySection(data);
  page += internal::MapSection(data);
  page += internal::HeldOutSection(data);
  page += internal::TimingSection(data);
  page += internal::TrainingSection(data);
  page += internal::GrowthSection(data);
  page += internal::DetailsSection(data);
  page +=
      fmt::format("<footer>covsplat {}</footer></main></body></html>\n", EscapeHtml(data.version));
  return page;
}

}  // namespace covsplat

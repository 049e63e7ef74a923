// SPDX-License-Identifier: Apache-2.0
#include "report/study_page.hpp"

#include "core/whole_file.hpp"
#include "report/document.hpp"

namespace ravencal::report {

core::Status write_study_html(const StudyPage& page, const std::filesystem::path& path) {
  Document document;
  for (const StudySection& section : page.sections) {
    document.section(section.id, section.title);
    document.add(section.html);
    for (const StudyFigure& figure : section.figures)
      document.figure(figure.spec, figure.heading, figure.caption, true);
  }
  document.provenance(page.provenance, page.reproduce);
  return core::write_whole_file(path, document.html({page.title, page.subtitle, page.verdict}));
}

}  // namespace ravencal::report

// SPDX-License-Identifier: Apache-2.0
// Files as read-only data; assets.hpp names them. Reason: compilers need seconds and hundreds of
// megabytes for string literals of this size, the assembler copies.
.macro asset name, file
  .global ravencal_report_\name
  .global ravencal_report_\name\()_end
ravencal_report_\name:
  .incbin "\file"
ravencal_report_\name\()_end:
.endm

.section .rodata
asset html, "page.html"
asset css, "page.css"
asset js, "page.js"
asset draw, "draw.js"
asset licences, "licences.txt"
asset vega, "vega.js"

.section .note.GNU-stack, "", %progbits

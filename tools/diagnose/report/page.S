// SPDX-License-Identifier: Apache-2.0
// page.js as read-only data, for page.cpp.
.section .rodata
.global ravencal_diagnose_page, ravencal_diagnose_page_end
ravencal_diagnose_page:
  .incbin "page.js"
ravencal_diagnose_page_end:

.section .note.GNU-stack, "", %progbits

// SPDX-License-Identifier: Apache-2.0
//
// Looks at a drawn page as a reader would and lists in <html data-findings="..."> what is not
// legible: parts wider than the page, texts on top of each other, small print, texts outside of any
// element. Details are unfolded first.
"use strict";

const smallest_px = 10;
const most_findings = 10; // of each kind

function shown(text) {
  return text.trim().slice(0, 40);
}

// Vega leaves labels that would overlap in place without opacity.
function is_hidden(element) {
  const style = getComputedStyle(element);
  return style.visibility === "hidden" || style.display === "none" || style.opacity === "0" ||
    element.closest('[opacity="0"]') !== null;
}

function font_px(element) {
  const size = parseFloat(getComputedStyle(element).fontSize);
  const svg = element.closest("svg");
  if (!svg || !svg.viewBox.baseVal.width) return size;
  return size * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
}

function rects_of(node, element) {
  if (element.closest("svg")) return [element.getBoundingClientRect()];
  const range = document.createRange();
  range.selectNodeContents(node);
  return [...range.getClientRects()];
}

function text_boxes() {
  const boxes = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const element = node.parentElement;
    if (!node.data.trim() || element.closest("script, style, noscript, title")) continue;
    if (is_hidden(element)) continue;
    for (const rect of rects_of(node, element)) {
      if (!rect.width || !rect.height) continue;
      boxes.push({ node, rect, text: shown(node.data), px: font_px(element) });
    }
  }
  return boxes;
}

// Lines of one text are set closer than their boxes: only the middle of a box is ink.
function overlap(a, b) {
  const slack_a = 0.2 * a.rect.height;
  const slack_b = 0.2 * b.rect.height;
  const across = Math.min(a.rect.right, b.rect.right) - Math.max(a.rect.left, b.rect.left);
  const down = Math.min(a.rect.bottom - slack_a, b.rect.bottom - slack_b) -
    Math.max(a.rect.top + slack_a, b.rect.top + slack_b);
  return across > 2 && down > 1;
}

function overlaps(boxes) {
  const found = [];
  boxes.sort((a, b) => a.rect.top - b.rect.top);
  for (let i = 0; i < boxes.length; ++i) {
    for (let j = i + 1; j < boxes.length && boxes[j].rect.top < boxes[i].rect.bottom; ++j) {
      if (boxes[i].node !== boxes[j].node && overlap(boxes[i], boxes[j]))
        found.push(`overlap: ${boxes[i].text} | ${boxes[j].text}`);
    }
  }
  return found;
}

function too_wide() {
  const found = [];
  const width = document.documentElement.clientWidth;
  for (const element of document.body.querySelectorAll(":not(svg *)")) {
    const rect = element.getBoundingClientRect();
    const cut = element.scrollWidth > element.clientWidth + 1 && element.matches(".chart, .scroll");
    if (rect.right > width + 1 || cut)
      found.push(`wide: ${element.tagName} ${element.className} ${Math.round(rect.right)} px`);
  }
  return found;
}

// A value that was taken for an element.
function bare_texts() {
  const texts = [...document.querySelector("main").childNodes].filter((node) => node.nodeType === Node.TEXT_NODE);
  return texts.filter((node) => node.data.trim()).map((node) => `bare: ${shown(node.data)}`);
}

function inspect() {
  if (!document.documentElement.dataset.chartsDrawn) {
    setTimeout(inspect, 50);
    return;
  }
  for (const details of document.querySelectorAll("details")) details.open = true;
  const boxes = text_boxes();
  const small = boxes.filter((box) => box.px < smallest_px)
    .map((box) => `small: ${box.text} ${box.px.toFixed(1)} px`);
  const findings = [too_wide(), small, overlaps(boxes), bare_texts()].flatMap((some) => some.slice(0, most_findings));
  document.documentElement.dataset.texts = boxes.length;
  document.documentElement.dataset.findings = findings.join("\n");
}
inspect();

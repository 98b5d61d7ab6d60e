// SPDX-License-Identifier: MIT
const scene = JSON.parse(document.getElementById("scene").textContent);
const element = id => document.getElementById(id);
const nextFrame = () => new Promise(done => setTimeout(done, 0));

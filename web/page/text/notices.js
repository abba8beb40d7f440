// Licence notices of all that is in the page. The text of a licence that several share stands once.
import apache from './apache-2.0.txt';

const kWarranty = `THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.`;
const kMit = `Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the "Software"), to deal in the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the Software.

${kWarranty}`;

const kZlib = `This software is provided 'as-is', without any express or implied warranty. In no event will the authors be held liable for any damages arising from the use of this software.

Permission is granted to anyone to use this software for any purpose, including commercial applications, and to alter it and redistribute it freely, subject to the following restrictions:

1. The origin of this software must not be misrepresented; you must not claim that you wrote the original software. If you use this software in a product, an acknowledgment in the product documentation would be appreciated but is not required.
2. Altered source versions must be plainly marked as such, and must not be misrepresented as being the original software.
3. This notice may not be removed or altered from any source distribution.`;

export const kNotices = [
  {name: 'Carom', licence: 'zlib licence', text: `Copyright (c) 2026 the Carom authors

${kZlib}`},
  {name: 'Bullet Collision Detection and Physics Library', licence: 'zlib licence: scenes on Bullet', text: `Copyright (c) 2003-2014 Erwin Coumans, https://bulletphysics.org, and the authors that its files name

${kZlib}`},
  {name: 'JSON for Modern C++', licence: 'MIT licence: reads scenes', text: `Copyright © 2013-2022 Niels Lohmann

${kMit}`},
  {name: 'three.js', licence: 'MIT licence: the picture', text: `The MIT License

Copyright © 2010-2026 three.js authors

${kMit}`},
  {name: 'Eigen', licence: 'Mozilla Public License 2.0: vectors and turns in the engine', text: `The engine in this page contains code of Eigen 3.4, a library of C++ templates for linear algebra, by its authors.

This Source Code Form is subject to the terms of the Mozilla Public License, v. 2.0. If a copy of the MPL was not distributed with this file, You can obtain one at https://mozilla.org/MPL/2.0/.

Eigen is used without changes. Its source is at https://gitlab.com/libeigen/eigen, and in the package libeigen3-dev of Debian 12.`},
  {name: 'Highway', licence: 'Apache License 2.0: the engine’s loops', text: `Copyright 2019-2022 Google LLC

Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with the License. The License is below, under "Apache License 2.0".

Unless required by applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language governing permissions and limitations under the License.`},
  {name: 'LLVM libc++, libc++abi, compiler-rt', licence: 'Apache License 2.0 with LLVM exceptions: the engine’s C++ library', text: `The LLVM Project is under the Apache License v2.0 with LLVM Exceptions. The License is below, under "Apache License 2.0".

---- LLVM Exceptions to the Apache 2.0 License ----

As an exception, if, as a result of your compiling your source code, portions of this Software are embedded into an Object form of such source code, you may redistribute such embedded portions in such Object form without complying with the conditions of Sections 4(a), 4(b) and 4(d) of the License.

In addition, if you combine or link compiled forms of this Software with software that is licensed under the GPLv2 ("Combined Software") and if a court of competent jurisdiction determines that the patent provision (Section 3), the indemnity provision (Section 9) or other Section of the License conflicts with the conditions of the GPLv2, you may retroactively and prospectively choose to deem waived or otherwise exclude such Section(s) of the License, but only in their entirety and only with respect to the Combined Software.`},
  {name: 'wasi-libc and musl', licence: 'MIT licence and others: the engine’s C library', text: `musl: Copyright © 2005-2020 Rich Felker, et al.

${kMit}

Parts of musl's mathematics: Copyright 1993, 2004 Sun Microsystems, Inc. Developed at SunPro, a Sun Microsystems, Inc. business. Permission to use, copy, modify, and distribute this software is freely granted, provided that this notice is preserved. Copyright 2017-2018 Arm Limited, under the MIT licence above.

wasi-libc, by Dan Gohman and the wasi-libc contributors, is in the public domain (CC0 1.0). It contains parts of cloudlibc: Copyright (c) 2015-2017 Nuxi, https://nuxi.nl/, and contributors, under the BSD licence of two clauses:

Redistribution and use in source and binary forms, with or without modification, are permitted provided that the following conditions are met:
1. Redistributions of source code must retain the above copyright notice, this list of conditions and the following disclaimer.
2. Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following disclaimer in the documentation and/or other materials provided with the distribution.

THIS SOFTWARE IS PROVIDED BY THE AUTHOR AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES, INCLUDING, BUT NOT LIMITED TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE DISCLAIMED. IN NO EVENT SHALL THE AUTHOR OR CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL, SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF LIABILITY, WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF THIS SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.`},
  {name: 'HRTF measurements of KEMAR', licence: 'MIT Media Lab: the head, where a page has one', text: `HRTF Measurements of a KEMAR Dummy-Head Microphone, by Bill Gardner and Keith Martin, MIT Media Lab Perceptual Computing.

Copyright 1994 by the MIT Media Laboratory. The data are provided free with no restrictions on use, provided the authors are cited when the data are used in any research or commercial application.

W. G. Gardner and K. D. Martin, "HRTF measurements of a KEMAR", Journal of the Acoustical Society of America 97 (6), 1995, 3907-3908.`},
  {name: 'Apache License 2.0', licence: 'of Highway and LLVM', text: apache},
];

; SPDX-License-Identifier: MIT
; The installer: makensis -DVERSION=... -DFOLDER=... -DOUT=... darb.nsi, run by tools/windows.sh. It installs for one
; user, so that it asks for no administrator.
Unicode true
SetCompressor /SOLID lzma
Name "darb ${VERSION}"
OutFile "${OUT}"
InstallDir "$LOCALAPPDATA\Programs\darb"
InstallDirRegKey HKCU "Software\darb" "folder"
RequestExecutionLevel user
LicenseData "${FOLDER}/LICENSE.txt"
Page license
Page components
Page directory
Page instfiles
UninstPage uninstConfirm
UninstPage instfiles

!define UNINSTALL "Software\Microsoft\Windows\CurrentVersion\Uninstall\darb"

Section "darb"
  SectionIn RO
  SetOutPath "$INSTDIR"
  File /r "${FOLDER}/*"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  WriteRegStr HKCU "Software\darb" "folder" "$INSTDIR"
  WriteRegStr HKCU "${UNINSTALL}" "DisplayName" "darb"
  WriteRegStr HKCU "${UNINSTALL}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKCU "${UNINSTALL}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegDWORD HKCU "${UNINSTALL}" "NoModify" 1
  WriteRegDWORD HKCU "${UNINSTALL}" "NoRepair" 1
  ; `darb` in a new console, without a change of PATH: what Run and Explorer look up.
  WriteRegStr HKCU "Software\Microsoft\Windows\CurrentVersion\App Paths\darb.exe" "" "$INSTDIR\darb.exe"
SectionEnd

!macro Opens ENDING
  WriteRegStr HKCU "Software\Classes\${ENDING}\OpenWithProgids" "darb.scene" ""
!macroend

Section "Open scenes by a double click: .ply .spz .splat .ksplat .sog"
  WriteRegStr HKCU "Software\Classes\darb.scene" "" "Splat scene"
  WriteRegStr HKCU "Software\Classes\darb.scene\shell\open\command" "" '"$INSTDIR\darb.exe" view "%1"'
  !insertmacro Opens ".ply"
  !insertmacro Opens ".spz"
  !insertmacro Opens ".splat"
  !insertmacro Opens ".ksplat"
  !insertmacro Opens ".sog"
SectionEnd

!macro OpensNoMore ENDING
  DeleteRegValue HKCU "Software\Classes\${ENDING}\OpenWithProgids" "darb.scene"
!macroend

Section "Uninstall"
  Delete "$INSTDIR\darb.exe"
  Delete "$INSTDIR\README.txt"
  Delete "$INSTDIR\LICENSE.txt"
  RMDir /r "$INSTDIR\licenses"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  DeleteRegKey HKCU "${UNINSTALL}"
  DeleteRegKey HKCU "Software\darb"
  DeleteRegKey HKCU "Software\Microsoft\Windows\CurrentVersion\App Paths\darb.exe"
  DeleteRegKey HKCU "Software\Classes\darb.scene"
  !insertmacro OpensNoMore ".ply"
  !insertmacro OpensNoMore ".spz"
  !insertmacro OpensNoMore ".splat"
  !insertmacro OpensNoMore ".ksplat"
  !insertmacro OpensNoMore ".sog"
SectionEnd

@echo off
rem Puts oncenter into a folder of this user: without internet, without administrator's rights.
rem Every path is in quotes: it may have spaces, umlauts, brackets and an ampersand.
setlocal DisableDelayedExpansion
title oncenter
set "HERE=%~dp0"
set "PLACE=%LOCALAPPDATA%\oncenter\python"
set "PYTHON=%PLACE%\python.exe"

echo.
echo oncenter is put into "%PLACE%".
echo This takes about two minutes. It needs no internet and no administrator.
echo.

set "STEP=finding the files beside install.cmd"
set "REMEDY=Close this window. Right-click the zip, choose Extract All, and start install.cmd in the new folder."
if not exist "%HERE%wheels\requirements.txt" goto failed

set "STEP=finding Python"
set "REMEDY=Download @PYTHON@ from python.org, extract it into the folder python beside install.cmd, and start install.cmd again."
if not exist "%HERE%python\python.exe" goto failed

set "STEP=removing the former oncenter"
set "REMEDY=Close all windows of oncenter, and start install.cmd again."
if exist "%PLACE%" rmdir /s /q "%PLACE%"
if exist "%PLACE%" goto failed

set "STEP=copying Python"
set "REMEDY=Make room on the disk: oncenter needs @MEGABYTES@ MB. Then start install.cmd again."
xcopy "%HERE%python" "%PLACE%" /e /i /q /y >nul
if not "%errorlevel%"=="0" goto failed
rem Where this Python looks for packages, and nowhere else: another Python on this computer changes nothing.
(
  echo @LIBRARY@.zip
  echo .
  echo Lib\site-packages
  echo import site
) >"%PLACE%\@LIBRARY@._pth"
if not exist "%PLACE%\@LIBRARY@._pth" goto failed

set "STEP=installing the packages"
for %%f in ("%HERE%wheels\pip-*.whl") do set "PIP=%%~ff\pip"
"%PYTHON%" "%PIP%" install --isolated --no-index --find-links "%HERE%wheels" --require-hashes --no-compile --no-warn-script-location --disable-pip-version-check --quiet -r "%HERE%wheels\requirements.txt"
if not "%errorlevel%"=="0" goto failed

set "STEP=putting the icon on the desktop"
set "REMEDY=oncenter itself is installed. The line above says why there is no icon."
"%PYTHON%" -m oncenter app --shortcut
if not "%errorlevel%"=="0" goto failed

echo.
echo oncenter is installed. Double-click the icon oncenter on the desktop: its page opens in the browser.
echo You may delete the folder from which you installed it.
echo To remove oncenter, delete the icon and the folder "%PLACE%".
echo.
pause
exit /b 0

:failed
echo.
echo It did not work. What failed: %STEP%.
echo %REMEDY%
echo.
pause
exit /b 1

!> Spectra of the cases of a sweep: the amplitudes that are stored with each case, and their group in the results file.
module sweep_spectra
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use hdf5_writing, only: hdf5_column_t
   use kinds, only: wp
   use quantities, only: quantity_named, units_t
   use quantity_groups, only: quantity_group_t
   use run_settings, only: end_of_run
   use scene_types, only: scene_t
   use spectrum_settings, only: signal_table
   use spectrum_types, only: amplitudes_of, run_spectrum_t
   implicit none (type, external)
   private
   public :: frequencies_of, spectrum_size, record_spectra, make_spectra, write_spectra

contains

   !> Frequencies of the spectra of a scene's cases, over omega1.
   pure function frequencies_of(scene) result(frequency)
      type(scene_t), intent(in) :: scene
      real(wp), allocatable :: frequency(:)

      real(wp) :: length
      integer :: i

      allocate (frequency(0))
      if (.not. scene%wants_spectrum) return
      associate (spectrum => scene%spectrum)
         length = min(spectrum%end, end_of_run(scene%response)) - spectrum%start
         frequency = [(spectrum%range(1) + spectrum%frequency_spacing(length)*real(i, wp), i=0, &
            nint(spectrum%frequency_count(length)) - 1)]
      end associate
   end function frequencies_of

   !> Number of amplitudes that are stored with each case.
   pure integer function spectrum_size(scene)
      type(scene_t), intent(in) :: scene

      spectrum_size = 0
      if (scene%wants_spectrum) spectrum_size = size(frequencies_of(scene))*size(scene%spectrum%of)
   end function spectrum_size

   !> Amplitudes of a case in units of the results, signal after signal; NaN if the case has other frequencies.
   pure subroutine record_spectra(spectrum, units, values)
      type(run_spectrum_t), intent(in) :: spectrum
      type(units_t), intent(in) :: units
      real(wp), intent(inout) :: values(:)

      real(wp), allocatable :: amplitude(:, :)
      integer :: k

      values = ieee_value(1.0_wp, ieee_quiet_nan)
      if (size(spectrum%power) /= size(values)) return
      allocate (amplitude, source=amplitudes_of(spectrum))
      if (units%are_physical) then
         do k = 1, size(spectrum%of)
            amplitude(:, k) = amplitude(:, k)*units%factor(quantity_named(signal_table(spectrum%of(k))%quantity))
         end do
      end if
      values = reshape(amplitude, [size(values)])
   end subroutine record_spectra

   !> Make the group of the results file, with datasets for all cases.
   subroutine make_spectra(group, scene, cases, scales_vary, columns)
      !> The group, still empty
      type(quantity_group_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: cases
      !> Whether the cases differ in their scales; that of the frequencies is the same for all, because lengths, section
      !> and material of the beam do not vary
      logical, intent(in) :: scales_vary
      !> Datasets of the amplitudes of each signal, [frequencies, cases]
      type(hdf5_column_t), allocatable, intent(out) :: columns(:)

      real(wp), allocatable :: frequency(:)
      integer :: i, k

      allocate (frequency, source=frequencies_of(scene))
      call group%put('omega', frequency, 'frequency', '{omega over omega1~frequency}', is_scale=.true.)
      if (scales_vary) group = group%unscaled(scales_vary)
      call group%put('case', [(i, i=1, cases)], 'number of the case', is_scale=.true.)
      allocate (columns(size(scene%spectrum%of)))
      do k = 1, size(columns)
         associate (signal => signal_table(scene%spectrum%of(k)))
            columns(k) = group%put_column('amplitude_'//trim(signal%name), [size(frequency), cases], &
               trim(signal%quantity), 'amplitude of the '//trim(signal%meaning)//' at each frequency, a row a case', &
               .false., 'case')
         end associate
      end do
   end subroutine make_spectra

   !> Write the amplitudes of consecutive cases.
   subroutine write_spectra(columns, first, values)
      type(hdf5_column_t), intent(in) :: columns(:)
      !> Number of the first case
      integer, intent(in) :: first
      !> Amplitudes as `record_spectra` orders them, [amplitudes, cases]
      real(wp), intent(in) :: values(:, :)

      integer :: k, points

      points = size(values, 1)/size(columns)
      do k = 1, size(columns)
         call columns(k)%put(first, reshape(values((k - 1)*points + 1:k*points, :), [points*size(values, 2)]))
      end do
   end subroutine write_spectra

end module sweep_spectra

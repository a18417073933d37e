!> The group `stress` of a results file: extremes and histories of bending moments and stresses at the positions
!> along the beam that the scene requests (places). In the meanings of datasets, {a} stands only in files without
!> units, and {a~b} stands for a in such files and for b in files with units (module `quantity_groups`).
module stress_groups
   use kinds, only: wp
   use quantity_groups, only: quantity_group_t
   use response_types, only: moment_record_t, moment_window_t
   use signal_peaks, only: peak_tolerance
   implicit none (type, external)
   private
   public :: write_stress

contains

   !> Write a list over the places for each extreme, and a table over instants and places for each history.
   subroutine write_stress(group, moments, tau, windows)
      type(quantity_group_t), intent(in) :: group
      !> Records of the places in the order of the scene, then those just beyond jumps of the moment
      type(moment_record_t), intent(in) :: moments(:)
      !> Sample times tau; without them no histories are written
      real(wp), contiguous, intent(in), optional :: tau(:)
      !> Moments within the window of &statistics; absent: not requested
      type(moment_window_t), intent(in), optional :: windows(:)

      ! name of the dimension scale of the places
      character(*), parameter :: place_scale = 'position'
      logical :: has_stress
      integer :: p

      ! stresses are known only if the distance of the outer fibre is known at all places
      has_stress = all(moments%has_stress)
      call group%attribute('sign', 'a moment is positive where it bends the beam upwards; the stress is that of the ' &
         //'outer fibre below the axis, moment times its distance over the second moment of area, positive in ' &
         //'tension; above the axis it is the opposite')
      call group%attribute('damping', 'moments and stresses include the part of damping in proportion to stiffness')
      call group%put(place_scale, [moments%position], 'length', 'places{, x/L}', is_scale=.true.)
      ! extremes are searched only if measures are requested; without a search `minimum` and `maximum` keep their
      ! initial values, with minimum > maximum
      if (all(moments%maximum >= moments%minimum)) then
         call add_extreme('greatest', [moments%maximum], [moments%maximum_tau], &
            maxval(moments%maximum_search%tolerance))
         call add_extreme('least', [moments%minimum], [moments%minimum_tau], &
            maxval(moments%minimum_search%tolerance))
      end if
      if (present(windows)) call write_windows(group, moments, windows, place_scale)
      if (.not. (present(tau) .and. all([(allocated(moments(p)%moment), p=1, size(moments))]))) return
      call group%put('tau', tau, 'time', 'time{ tau}', is_scale=.true.)
      call add_history('moment', [(moments(p)%moment, p=1, size(moments))], 'bending moment{, Pbar L}')
      if (has_stress) call add_history('stress', [(moments(p)%stress_per_moment*moments(p)%moment, p=1, &
         size(moments))], 'stress{, in E D/L}')

   contains

      !> Write moments and stresses of one extreme at all places. `greatest` and `least` are the names in files of the
      !> signed maximum and minimum; the measure `greatest_moment` is a magnitude.
      subroutine add_extreme(which, values, instants, tolerance)
         character(*), intent(in) :: which
         !> Extreme moments
         real(wp), intent(in) :: values(:)
         !> Instants of the extremes, tau
         real(wp), intent(in) :: instants(:)
         !> Maximum over the places of the tolerance of the search, as a fraction of the extreme
         real(wp), intent(in) :: tolerance

         call group%put(which//'_moment', values, 'moment', which//' bending moment, with its sign{, Pbar L}', &
            place_scale)
         if (has_stress) call group%put(which//'_stress', moments%stress_per_moment*values, 'stress', &
            which//' stress, with its sign{, in E D/L}', place_scale)
         call mark_tolerance(group, which, tolerance, has_stress)
         call group%put(which//'_tau', instants, 'time', 'instant of the '//which//' bending moment{, tau}', &
            place_scale)
      end subroutine add_extreme

      !> Write a history at all places.
      subroutine add_history(name, values, meaning)
         character(*), intent(in) :: name
         !> Values at all sample times, place after place
         real(wp), intent(in) :: values(:)
         character(*), intent(in) :: meaning

         call group%put(name, reshape(values, [size(tau), size(moments)]), name, meaning, 'tau '//place_scale)
      end subroutine add_history
   end subroutine write_stress

   !> Write the tolerance of extremes as an attribute, if a search ran out of evaluations and raised it.
   subroutine mark_tolerance(group, which, tolerance, has_stress)
      type(quantity_group_t), intent(in) :: group
      !> Begin of the names of the datasets
      character(*), intent(in) :: which
      !> Maximum over the places, as a fraction of the extreme
      real(wp), intent(in) :: tolerance
      !> Whether there are stresses beside the moments
      logical, intent(in) :: has_stress

      if (.not. tolerance > peak_tolerance) return
      call group%attribute('tolerance', tolerance, group%named(which//'_moment'))
      if (has_stress) call group%attribute('tolerance', tolerance, group%named(which//'_stress'))
   end subroutine mark_tolerance

   !> Write extremes within the window of &statistics, and cycles of stresses.
   subroutine write_windows(group, moments, windows, place_scale)
      type(quantity_group_t), intent(in) :: group
      type(moment_record_t), intent(in) :: moments(:)
      type(moment_window_t), intent(in) :: windows(:)
      !> Name of the dimension scale of the places
      character(*), intent(in) :: place_scale

      character(*), parameter :: which(2) = [character(7) :: 'minimum', 'maximum']
      integer :: classes, i, p

      call group%put_attribute('window_start', windows(1)%window(1), 'time')
      call group%put_attribute('window_end', windows(1)%window(2), 'time')
      do i = 1, 2
         call group%put(which(i)//'_moment', [(windows(p)%extremes(i), p=1, size(windows))], 'moment', &
            which(i)//' bending moment within the window{, Pbar L}', place_scale)
         if (all(moments%has_stress)) call group%put(which(i)//'_stress', [(moments(p)%stress_per_moment &
            *windows(p)%extremes(i), p=1, size(windows))], 'stress', &
            which(i)//' stress within the window{, in E D/L}', place_scale)
         call mark_tolerance(group, which(i), maxval(windows%tolerance), all(moments%has_stress))
      end do
      if (.not. all([(allocated(windows(p)%class_edge), p=1, size(windows))])) return
      call group%attribute('fatigue_slope', windows(1)%slope)
      call group%put('stress_cycles', windows%cycles, 'number', 'cycles of the stress by rainflow counting', &
         place_scale)
      call group%put('equivalent_range', windows%equivalent_range, 'stress', &
         'range at which the same number of equal cycles would do the same fatigue damage{, in E D/L}', place_scale)
      call group%put('counted_until', windows%counted_until, 'time', 'instant up to which cycles are counted{, tau}', &
         place_scale)
      classes = size(windows(1)%class_edge)
      call group%put('class', [(i, i=1, classes)], 'class of ranges', is_scale=.true.)
      call group%put('range_edge', reshape([(windows(p)%class_edge, p=1, size(windows))], [classes, size(windows)]), &
         'stress', 'upper end of the class of ranges{, in E D/L}', 'class '//place_scale)
      call group%put('range_cycles', reshape([(windows(p)%class_cycles, p=1, size(windows))], [classes, &
         size(windows)]), 'number', 'stress cycles in the class of ranges', 'class '//place_scale)
   end subroutine write_windows

end module stress_groups
